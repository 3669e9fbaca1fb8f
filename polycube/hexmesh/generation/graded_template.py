"""Hex mesh of a lattice with hexes as small as its cells, and larger ones away from details."""

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.connectivity import genus
from polycube.hexmesh.generation.graded_lattice import graded
from polycube.hexmesh.generation.requests_met import WantedSizes
from polycube.hexmesh.generation.sizing import Box, doublings
from polycube.structure import lattice
from polycube.structure.rough_map import evaluate
from polycube.surface.feature_size import small_details
from polycube.surface.fit_target import Target
from polycube.surface.measures import unit
from polycube.types import HexMesh, Polycube, RoughMap

logger = logging.getLogger(__name__)

NEAR = 1.0  # of a block: distance from a small detail within which it is divided


def graded_mesh(
    polycube: Polycube,
    rough_map: RoughMap,
    goal: Target,
    size: float,
    across: float,
    around: float,
    boxes: Sequence[Box] = (),
    wanted: WantedSizes | None = None,
) -> HexMesh | None:
    """Hexes of a polycube each of whose cells is a box; larger ones away from small details.

    Each size is twice the next smaller one. Returns HexMesh, or None if there would be no gain or
    if the topology would change.

    size : approximate size of the largest hexes, in model units
    across, around : hexes across a wall and around a hole
    boxes : regions with requested sizes
    wanted : requested sizes at points of the surface
    """
    full = polycube.occupancy
    places = goal.to_unit(evaluate(rough_map, np.argwhere(full) + 0.5))
    steps = [np.linalg.norm(np.diff(rough_map.positions, axis=a), axis=-1).mean() for a in range(3)]
    cell = float(np.mean(steps)) / goal.scale
    needed = []
    for number in range(1, doublings(size / goal.scale, cell) + 1):
        block = 2**number * cell
        details = small_details(goal, block, across, around)
        if wanted is not None:
            details = np.concatenate([details, wanted.points[wanted.sizes < block]])
        needed.append(np.zeros(full.shape, bool))
        if len(details):
            needed[-1][full] = cKDTree(details).query(places)[0] < NEAR * block
        for box in boxes:
            if box.size < block * goal.scale:
                needed[-1][full] |= box.holds(goal.to_model(places))
    while needed:
        mesh = graded(full, needed)
        if mesh is not None and genus(mesh) == lattice.genus(polycube):
            logger.info("subdivide: %d hexes of %d cells", len(mesh.hexes), full.sum())
            return _named(mesh, polycube, rough_map)
        needed.pop()
    logger.info("subdivide: all hexes are as small as the cells of the lattice")
    return None


def _named(mesh: HexMesh, polycube: Polycube, rough_map: RoughMap) -> HexMesh:
    """The mesh in model coordinates, with the closest patches and cells of the polycube."""
    boxes = np.argwhere(polycube.occupancy)
    nearest = cKDTree(boxes + 0.5).query(mesh.vertices[mesh.hexes].mean(axis=1))[1]
    sides = lattice.boundary(polycube)
    tree = cKDTree(_places(sides.vertices, sides.quads))
    patch = sides.patch[tree.query(_places(mesh.vertices, mesh.quads))[1]]
    cell = np.ravel_multi_index(boxes[nearest].T, polycube.grid)
    return replace(mesh, vertices=evaluate(rough_map, mesh.vertices), patch=patch, cell=cell)


def _places(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(Q, 6) centres and normals of quads, to find close ones with the same orientation."""
    a, b, c, d = np.moveaxis(vertices[quads], 1, 0)
    return np.hstack([(a + b + c + d) / 4, 4 * unit(np.cross(c - a, d - b))])
