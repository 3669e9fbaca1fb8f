"""Quads of a section, swept along an axis."""
