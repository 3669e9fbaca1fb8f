"""Build a lattice of bricks from a voxel solid.

Imports the core and the slices.
"""
