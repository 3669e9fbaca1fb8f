"""Cures of the worst hexes, one place at a time: a new fit there, or a sheet of hexes.

`fitted` holds a mesh and what its boundary is held to, `sets` says round which hexes a sheet may
help, `neighbourhood` cuts out what is near, with the sheet, `refit` fits that alone, and `cure`
tries one after the other and keeps what helps.
"""
