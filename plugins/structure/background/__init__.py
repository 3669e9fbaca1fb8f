"""Structures whose hexes are columns over a plane section: sweeps and turned parts."""
