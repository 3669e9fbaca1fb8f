"""Hex meshes: connectivity, templates, sizes, quality, certificates and named sets.

Imports structure, surface and below.
"""
