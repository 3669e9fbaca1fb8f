"""The solids of a CAD file with several: their names, and identical solids with their motions."""
