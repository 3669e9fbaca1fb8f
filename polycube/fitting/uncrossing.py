"""Mend a boundary that crosses itself at a few places.

Two quads that fold over each other, or stick into one another, part when their vertices move
towards their neighbours on the boundary.  They leave the surface by that.  Where they have to move
so far that hexes are inverted, the hexes near them are untangled.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix

from polycube.fitting.polish import untangled
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import part, quad_edges, quad_sides
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

MOST = 40  # pairs of quads; more of them are no accident
SHARES = (0.05, 0.1, 0.2, 0.3, 0.45)  # of the way to the mean of the neighbours
STEPS = 12  # halfway there each, until no quads cross
RINGS = (2, 3, 4, 5)  # of hexes round what moved that are untangled, tried in turn


def without_crossings(mesh: HexMesh, target: Target) -> HexMesh:
    """Move the vertices of quads that cross, as little as parts them.

    Parameters
    ----------
    mesh : fitted
    target : what it is fitted to

    Returns
    -------
    The mesh with other vertices, without crossings and inverted hexes; the same where it has none
    of the former, more than `MOST`, any of the latter, or where nothing parts them
    """
    found = crossings(mesh)
    if not 0 < len(found) <= MOST or scaled_jacobian(mesh.vertices, mesh.hexes).min() <= 0:
        return mesh
    means = _means(mesh)
    moved = np.unique(mesh.quads[np.unique(found)])
    way = means[moved] @ mesh.vertices - mesh.vertices[moved]
    for share in SHARES:
        vertices = mesh.vertices.copy()
        vertices[moved] += share * way
        tried = replace(mesh, vertices=vertices)
        if _is_sound(tried):
            break
    else:
        tried = _unfolded(mesh, target, means)
        if not _is_sound(tried):
            return mesh
    logger.info("crossings: %d pairs of quads separated", len(found))
    return tried


def _is_sound(mesh: HexMesh) -> bool:
    return scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0 and not len(crossings(mesh))


def _means(mesh: HexMesh) -> csr_matrix:
    """(V, V) rows that give the mean of a vertex's neighbours on the boundary."""
    ends, _ = quad_edges(mesh.quads)
    rows, columns = np.concatenate([ends, ends[:, ::-1]]).T
    number = np.bincount(rows, minlength=len(mesh.vertices))
    return csr_matrix((1 / number[rows], (rows, columns)), 2 * (len(mesh.vertices),))


def _unfolded(mesh: HexMesh, target: Target, means: csr_matrix) -> HexMesh:
    """Quads parted however far they go, and the hexes near them untangled; sound if that works."""
    tried = mesh
    for rings in RINGS:
        tried = _parted(tried, means)
        moved = (tried.vertices != mesh.vertices).any(axis=1)
        tried = _untangled_near(tried, moved, rings, target)
        if _is_sound(tried):
            break
    return tried


def _parted(mesh: HexMesh, means: csr_matrix) -> HexMesh:
    """Vertices of quads that cross halfway to the mean of their neighbours, again and again."""
    for _ in range(STEPS):
        found = crossings(mesh)
        if not len(found):
            break
        moved = np.unique(mesh.quads[np.unique(found)])
        vertices = mesh.vertices.copy()
        vertices[moved] = (vertices[moved] + means[moved] @ vertices) / 2
        mesh = replace(mesh, vertices=vertices)
    return mesh


def _untangled_near(mesh: HexMesh, moves: np.ndarray, rings: int, target: Target) -> HexMesh:
    """The mesh with the vertices in so many rings of hexes round some (V,) moved."""
    for _ in range(rings):
        moves[mesh.hexes[moves[mesh.hexes].any(axis=1)]] = True
    elements = np.flatnonzero(moves[mesh.hexes].any(axis=1))
    piece, used = part(mesh, elements, np.stack(quad_sides(mesh), axis=1))
    problem = FitProblem(piece, target, samples=1)
    x = untangled(problem, target.to_unit(piece.vertices), moves[used])
    vertices = mesh.vertices.copy()
    vertices[used[moves[used]]] = target.to_model(x)[moves[used]]
    return replace(mesh, vertices=vertices)
