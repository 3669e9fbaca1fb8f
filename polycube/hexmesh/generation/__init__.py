"""Make hex meshes: of a polycube, with sizes that were asked for, and by sheets of hexes.

Imports structure, surface, hexmesh and below.
"""
