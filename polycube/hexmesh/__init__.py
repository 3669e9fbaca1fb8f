"""Hex meshes: connectivity, generation, quality, certificates and named sets.

Imports `structure`, `surface` and the layers below.
"""
