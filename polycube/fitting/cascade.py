"""A better rough map from a coarse mesh that has been registered.

Long moves are cheap on few hexes; a fine template placed by the outcome has only short ones left.
"""

from __future__ import annotations

import numpy as np

from polycube.fitting.registration import register_mesh
from polycube.hexmesh.generation.template import counts, grid_lines, mesh
from polycube.structure.rough_map import evaluate, identity_map
from polycube.surface.fit_target import Target
from polycube.types import PerAxis, Polycube, RoughMap

RATIO = 1.4  # between the sizes of a mesh and of the next coarser one


def cascade(
    polycube: Polycube,
    rough_map: RoughMap,
    target: Target,
    size: float,
    coarse: float,
    features: bool = False,
) -> RoughMap:
    """The rough map registered at sizes from `coarse` down, the last one coarser than `size`.

    size, coarse : lengths in model units; the map given is returned where size is near to coarse
    features : hold the curves of the surface meanwhile
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
    """Where the polycube lies after a registration of hexes with so many parts per interval."""
    start = mesh(polycube, rough_map, parts)
    coarse = register_mesh(start, target, rounds=15, iterations=15, samples=1500, features=features)
    places = mesh(polycube, identity_map(polycube), parts).vertices
    lines = grid_lines(polycube, parts)
    lattice = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    positions = evaluate(rough_map, lattice.reshape(-1, 3)).reshape(lattice.shape)  # in holes too
    index = [np.searchsorted(line, places[:, axis] - 1e-9) for axis, line in enumerate(lines)]
    positions[tuple(index)] = coarse.vertices
    x, y, z = lines
    return RoughMap(x, y, z, positions)
