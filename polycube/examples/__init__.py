"""Parts that the program makes itself, as implicit solids and their triangles.

Imports surface and below.
"""
