"""Volumetric splines on a hex mesh."""
