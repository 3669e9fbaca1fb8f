"""Lattices with cells of the size of the hexes."""
