"""Grids of columns over a plane section, from which the hexes of swept and turned parts are cut."""
