"""Move the vertices of a hex mesh: registration to a surface, pillowing, polishing, refinement."""
