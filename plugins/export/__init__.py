"""Exporters of the hex mesh, one module for each format; see docs/reference/files.md.

Coordinates are written exactly, except in Nastran and LS-DYNA, whose columns have room for ten
digits. The vertices of a hexahedron are in the order of VTK in all formats. Nodes and elements have
the numbers of `hex.vtu`, starting at one.
"""
