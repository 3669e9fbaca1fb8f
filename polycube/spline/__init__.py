"""Volumetric splines: extraction, Bezier elements, analysis; numpy and scipy only."""
