"""Repair a boundary that crosses itself at a few places.

Two quads that fold over or penetrate each other separate when their vertices move towards their
neighbours on the boundary. The vertices leave the surface in this way. If they must move so far
that hexes are inverted, the hexes nearby are untangled.
"""

import logging
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix

from polycube.fitting.partial import is_sound
from polycube.fitting.polish import untangled
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import part, quad_edges, quad_sides
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

MOST = 40  # largest number of pairs of quads that are repaired
SHARES = (0.05, 0.1, 0.2, 0.3, 0.45)  # of the vector to the mean of the neighbours
STEPS = 12  # largest number of steps of half of this vector, until no quads cross
# rings of hexes around the moved vertices that are untangled, tried in sequence
RINGS = (2, 3, 4, 5)


def without_crossings(mesh: HexMesh, target: Target) -> HexMesh:
    """Move the vertices of crossing quads, by the smallest displacement that separates them.

    Parameters
    ----------
    mesh : fitted mesh
    target : the surface to which it is fitted

    Returns
    -------
    The mesh with moved vertices, without crossings and inverted hexes. It is unchanged if it has no
    crossings or more than `MOST`, if it has inverted hexes, or if the quads cannot be separated
    """
    found = crossings(mesh)
    if not 0 < len(found) <= MOST or scaled_jacobian(mesh.vertices, mesh.hexes).min() <= 0:
        return mesh
    means = _means(mesh)
    moved = np.unique(mesh.quads[np.unique(found)])
    step = means[moved] @ mesh.vertices - mesh.vertices[moved]
    for share in SHARES:
        vertices = mesh.vertices.copy()
        vertices[moved] += share * step
        tried = replace(mesh, vertices=vertices)
        if is_sound(tried):
            break
    else:
        tried = _unfolded(mesh, target, means)
        if not is_sound(tried):
            return mesh
    logger.info("crossings: %d pairs of quads separated", len(found))
    return tried


def _means(mesh: HexMesh) -> csr_matrix:
    """(V, V) matrix that averages the neighbours of a vertex on the boundary."""
    ends, _ = quad_edges(mesh.quads)
    rows, columns = np.concatenate([ends, ends[:, ::-1]]).T
    number = np.bincount(rows, minlength=len(mesh.vertices))
    return csr_matrix((1 / number[rows], (rows, columns)), 2 * (len(mesh.vertices),))


def _unfolded(mesh: HexMesh, target: Target, means: csr_matrix) -> HexMesh:
    """Separate quads without a limit and untangle the hexes nearby; sound if successful.

    The vertices of crossing quads move halfway to the mean of their neighbours, repeatedly.
    """
    tried = mesh
    for rings in RINGS:
        for _ in range(STEPS):
            found = crossings(tried)
            if not len(found):
                break
            moved = np.unique(tried.quads[np.unique(found)])
            vertices = tried.vertices.copy()
            vertices[moved] = (vertices[moved] + means[moved] @ vertices) / 2
            tried = replace(tried, vertices=vertices)
        moved = (tried.vertices != mesh.vertices).any(axis=1)
        tried = _untangled_near(tried, moved, rings, target)
        if is_sound(tried):
            break
    return tried


def _untangled_near(mesh: HexMesh, moves: np.ndarray, rings: int, target: Target) -> HexMesh:
    """The mesh after moving the vertices in some rings of hexes around the given ones (V,)."""
    for _ in range(rings):
        moves[mesh.hexes[moves[mesh.hexes].any(axis=1)]] = True
    elements = np.flatnonzero(moves[mesh.hexes].any(axis=1))
    piece, used = part(mesh, elements, np.stack(quad_sides(mesh), axis=1))
    problem = FitProblem(piece, target, samples=1)
    x = untangled(problem, target.to_unit(piece.vertices), moves[used])
    vertices = mesh.vertices.copy()
    vertices[used[moves[used]]] = target.to_model(x)[moves[used]]
    return replace(mesh, vertices=vertices)
