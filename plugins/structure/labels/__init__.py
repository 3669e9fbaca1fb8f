"""Propose polycubes from labels of the surface: one of six directions per face of the part."""
