"""Read a polycube off the slices of a voxel solid.

Imports the core and this folder.
"""
