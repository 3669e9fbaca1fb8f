"""The solids of a CAD file with several: their names, and which are the same but for a motion."""
