"""Training pairs: random polycubes, deformed to resemble real parts."""
