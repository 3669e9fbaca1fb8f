"""Polycubes: boxes on a lattice, their faces and genus, and rough maps onto a part."""
