"""Reconstruction of a closed surface from a point cloud."""
