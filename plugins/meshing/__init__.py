"""Plugins of the meshing stages."""
