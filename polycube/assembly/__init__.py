"""Several solids, each with its mesh: where they touch, where the meshes agree there, one mesh."""
