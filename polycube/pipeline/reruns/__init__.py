"""More runs of the variant of the best mesh: smaller hexes, other sheets, other numbers."""
