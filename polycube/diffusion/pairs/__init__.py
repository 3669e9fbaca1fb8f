"""Training pairs: random polycubes, deformed to resemble real parts.

Imports `diffusion` and the layers below.
"""
