"""The diffusion model: encoding, drift process, networks, weights; torch is imported here only.

Imports structure, surface, io and below.
"""
