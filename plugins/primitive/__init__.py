"""Unit cells of polycubes."""
