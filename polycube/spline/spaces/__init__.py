"""Spline spaces on unstructured hex meshes: extraction, subdivision, hierarchies.

Imports `spline` and the layers below.
"""
