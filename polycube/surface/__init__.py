"""Triangle surfaces: measures, frames, creases, closest points, crossings; no files.

Imports numerics and the data types.
"""
