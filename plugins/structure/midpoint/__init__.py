"""Midpoint subdivision of polyhedra."""
