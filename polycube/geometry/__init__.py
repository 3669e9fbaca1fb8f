"""Surfaces, lattices, hex topology, quality and the energies of the morph; no torch."""
