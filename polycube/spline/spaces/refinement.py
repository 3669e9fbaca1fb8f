"""Refine a spline by the options of its plugin, level by level."""

import numpy as np

from polycube.spline.spaces.extraction import NO_INDICES
from polycube.spline.spaces.hierarchy import Space, coarsest, finer_level, hierarchical_spline
from polycube.spline.spaces.selection import Refinement, check_listed
from polycube.types import Spline, TriMesh


def refined_spline(
    space: Space, refine: Refinement, surface: TriMesh, extraordinary_edges: int = 0
) -> Spline:
    """The truncated hierarchical spline; without refinement, the spline of the space.

    Raises InputError for listed elements that do not exist.
    """
    levels = [coarsest(space, refine.levels)]
    listed = refine.listed()
    check_listed(listed, len(levels[0].inside))
    while True:
        level, depth = levels[-1], len(levels) - 1
        # first, so that its children keep their numbers
        wanted = listed[depth] if depth < len(listed) else NO_INDICES
        marked = np.setdiff1d(refine.marked(level, depth, surface), wanted)
        chosen = np.concatenate([wanted, marked])
        if len(chosen) == 0:
            return hierarchical_spline(levels, extraordinary_edges)
        levels.append(finer_level(level, chosen))
