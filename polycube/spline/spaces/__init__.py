"""Spline spaces on unstructured hex meshes: extraction, subdivision, hierarchies."""
