"""Proposals of polycubes for a surface."""
