"""Build a lattice of bricks from a voxel solid.

Imports `polycube` and `slices`.
"""
