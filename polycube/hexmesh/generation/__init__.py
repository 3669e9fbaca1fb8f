"""Generation of hex meshes from polycubes, with requested sizes, and by sheets of hexes.

Imports `structure`, `surface`, `hexmesh` and the layers below.
"""
