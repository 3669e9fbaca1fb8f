"""Training pairs: random polycubes, deformed as real parts are.

Imports diffusion and below.
"""
