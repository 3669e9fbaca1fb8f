"""Volumetric splines on hex meshes: Bezier elements, fit, certificates; numpy and scipy only."""
