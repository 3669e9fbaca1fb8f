"""Hex meshes: connectivity, generation, quality, certificates and named sets."""
