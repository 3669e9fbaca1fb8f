"""Lattices as fine as the hexes, overlaid on the part."""
