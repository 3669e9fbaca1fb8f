"""Triangle surfaces: measures, frames, creases, closest points, intersections. No file access.

Imports `numerics` and the data types.
"""
