"""The paper's map: segment the surface, flatten each patch, extend the map to the inside.

Imports hexmesh and below.
"""
