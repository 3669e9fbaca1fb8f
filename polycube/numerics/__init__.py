"""Numerical methods without meshes: threads, descent, sparse solvers.

Imports numpy, scipy and numba only.
"""
