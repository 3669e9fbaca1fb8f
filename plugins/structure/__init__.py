"""Proposals of a polycube for a surface."""
