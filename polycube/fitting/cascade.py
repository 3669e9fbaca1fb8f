"""Improve a rough map by registration of coarse meshes.

Large displacements are cheap with few hexes; the fine mesh then needs only small ones.
"""

import numpy as np

from polycube.fitting.registration import register_mesh
from polycube.hexmesh.generation.template import counts, map_through, mesh
from polycube.surface.fit_target import Target
from polycube.types import PerAxis, Polycube, RoughMap

RATIO = 1.4  # ratio of the sizes of a mesh and the next coarser one


def cascade(
    polycube: Polycube,
    rough_map: RoughMap,
    target: Target,
    size: float,
    coarse: float,
    features: bool = False,
) -> RoughMap:
    """Register the rough map at decreasing sizes, from `coarse` to the last one coarser than
    `size`.

    size, coarse : lengths in model units; if `size` is close to `coarse`, the map is returned
        unchanged
    features : whether mesh edges follow the curves of the surface
    """
    placed = rough_map
    for level in range(round(np.log(coarse / size) / np.log(RATIO))):
        parts = counts(polycube, rough_map, coarse / RATIO**level)
        placed = registered_map(polycube, placed, target, parts, features)
    return placed


def registered_map(
    polycube: Polycube,
    rough_map: RoughMap,
    target: Target,
    parts: PerAxis,
    features: bool = False,
) -> RoughMap:
    """Rough map after a registration of hexes with the given parts per interval."""
    start = mesh(polycube, rough_map, parts)
    coarse = register_mesh(start, target, rounds=15, iterations=15, samples=1500, features=features)
    return map_through(polycube, rough_map, parts, coarse.vertices)
