"""The hex mesh in the formats of other programs, one to a module; see docs/reference/files.md.

Coordinates are exact to the last bit, in Nastran and LS-DYNA to ten digits: their columns end.
The order of the nodes of a hexahedron is VTK's in all formats; numbers of nodes and elements are
those of `hex.vtu`, from one.
"""
