"""Sweep quads of a section along an axis."""
