"""Readers of meshes of polygons: PLY, OFF and OBJ."""
