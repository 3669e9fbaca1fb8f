"""Turn the points of a scan into a closed surface.

Imports surface and below.
"""
