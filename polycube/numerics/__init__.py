"""Numerical methods that know nothing of meshes: threads, descent, sparse solvers.

Imports numpy, scipy and numba only.
"""
