"""Exporters of the hex mesh, one module for each format; see docs/reference/files.md.

Coordinates are exact, except in Nastran and LS-DYNA, whose fields are limited to ten digits. The
vertices of a hexahedron are in the order of VTK in all formats. Nodes and elements have the numbers
of `hex.vtu`, starting at one.
"""
