"""Numerical methods without meshes: threads, descent, sparse solvers."""
