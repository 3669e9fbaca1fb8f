"""Local improvement of the worst hexes: a new fit of a neighbourhood, or a sheet of hexes.

`fitted` holds a mesh and the constraints of its boundary and selects hexes for a sheet,
`neighbourhood` extracts the surroundings with the sheet, `envelope` and `refit` fit them,
`insertion` puts them back, and `cure` tries the cures and keeps the successful ones.
"""
