"""From a surface to an analysed solid: run state, stages, search, acceptance, deadline."""
