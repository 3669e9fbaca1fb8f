"""Polycubes from the slices of a voxel solid.

Imports `polycube` and this folder.
"""
