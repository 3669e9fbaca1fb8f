"""Read surfaces, CAD files and hex meshes; write meshes, splines and solutions.

Imports `analysis` and the layers below.
"""
