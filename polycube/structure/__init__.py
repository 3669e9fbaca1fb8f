"""Polycubes: boxes on a lattice, their faces and genus, and rough maps onto a part.

Imports `surface` and the layers below.
"""
