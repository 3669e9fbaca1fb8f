"""Polycubes from the slices of a voxel solid."""
