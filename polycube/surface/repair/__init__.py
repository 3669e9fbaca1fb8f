"""Turn the triangles of a file into a closed, oriented surface, and report what was changed.

Imports surface and below.
"""
