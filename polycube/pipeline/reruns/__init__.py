"""More runs of the variant whose mesh is taken: smaller hexes, other sheets, other numbers."""
