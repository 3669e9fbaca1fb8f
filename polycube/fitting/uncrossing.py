"""Keep a mesh sound: fit it only as far, or repair a boundary that crosses itself at a few places.

A mesh is sound if all scaled Jacobians are positive and its boundary does not cross itself.
"""

import logging
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix

from polycube.fitting.pillow import layer
from polycube.fitting.problem import FitProblem
from polycube.fitting.untangling import untangled
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
LEAST = 0.05  # smallest scaled Jacobian of a hex, unless it was smaller before
ROUNDING = 1 - 1e-9  # factor that allows for rounding errors in a hex that is only translated
SMALLEST = 1 / 16  # smallest share; smaller ones become zero
ADVANCES = 6  # rounds, each of which halves the remaining distance


def is_sound(mesh: HexMesh) -> bool:
    """Whether all scaled Jacobians are positive and the boundary does not cross itself."""
    return scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0 and not len(crossings(mesh))


def partly_fitted(mesh: HexMesh, fitted: np.ndarray) -> tuple[HexMesh, np.ndarray]:
    """Move the vertices of a sound mesh towards their fitted positions while it stays sound.

    Each vertex moves by a share of the vector to its fitted position. Starting with a share of 1,
    the vertices of bad hexes are moved back until no hex is bad, and then forward again as far as
    no hex becomes bad. With shares of 0 the mesh is unchanged, so the result is always sound.
    Returns the mesh, and the share (V,) of the displacement of each vertex, from 0 to 1. Raises
    ValueError if the mesh is not sound, or if positions are not finite or have another shape.

    mesh : hex mesh with positive scaled Jacobians and without crossings of the boundary
    fitted : (V, 3) fitted positions of its vertices, in model units
    """
    if fitted.shape != mesh.vertices.shape or not np.isfinite(fitted).all():
        raise ValueError(f"fitted must be finite of shape {mesh.vertices.shape}")
    if not is_sound(mesh):
        raise ValueError("the mesh to fit must have positive hexes and no crossing")
    floor = np.minimum(LEAST, ROUNDING * scaled_jacobian(mesh.vertices, mesh.hexes))
    share = np.ones(len(fitted))
    while (bad := _bad(_moved(mesh, fitted, share), floor)).any():
        near = np.zeros(len(share), bool)
        near[mesh.hexes[bad[mesh.hexes].any(axis=1)]] = True
        share[near] /= 2
        share[share < SMALLEST] = 0
    for _ in range(ADVANCES):
        if (share == 1).all():
            break
        wanted = np.where(share > 1 - SMALLEST, 1, (1 + share) / 2)
        while (bad := _bad(_moved(mesh, fitted, wanted), floor)).any():
            wanted[bad] = share[bad]
        share = wanted
    return _moved(mesh, fitted, share), share


def with_layer(mesh: HexMesh, target: Target) -> HexMesh:
    """A sound mesh with a layer of hexes under its boundary, or unchanged if it would not be sound.

    Without the layer, hexes with two faces on one smooth face of the part would be flat.

    mesh : hex mesh with positive scaled Jacobians and without crossings of the boundary
    target : the surface to which it will be fitted
    """
    layered = layer(mesh, mesh.patch, np.ones(len(mesh.quads), bool))
    x = untangled(FitProblem(layered, target, samples=1), target.to_unit(layered.vertices))
    layered = replace(layered, vertices=target.to_model(x))
    return layered if is_sound(layered) else mesh


def _moved(mesh: HexMesh, fitted: np.ndarray, share: np.ndarray) -> HexMesh:
    """The mesh with each vertex moved by its share of the displacement; exact for 0 and 1."""
    factor = share[:, None]
    between = mesh.vertices + factor * (fitted - mesh.vertices)
    return replace(mesh, vertices=np.where(factor == 1, fitted, between))


def _bad(mesh: HexMesh, floor: np.ndarray) -> np.ndarray:
    """(V,) whether a vertex has a hex below its limit (H,) or a quad that crosses another."""
    bad = np.zeros(len(mesh.vertices), bool)
    bad[mesh.hexes[scaled_jacobian(mesh.vertices, mesh.hexes) < floor]] = True
    if not bad.any():  # the more expensive test, for meshes without bad hexes
        bad[mesh.quads[crossings(mesh)]] = True
    return bad


def without_crossings(mesh: HexMesh, target: Target) -> HexMesh:
    """Move the vertices of crossing quads, by the smallest displacement that separates them.

    Two quads that fold over or penetrate each other separate when their vertices move towards their
    neighbours on the boundary. The vertices leave the surface in this way. If they must move so far
    that hexes are inverted, the hexes nearby are untangled. Returns the mesh with moved vertices,
    without crossings and inverted hexes. It is unchanged if it has no crossings or more than
    `MOST`, if it has inverted hexes, or if the quads cannot be separated.

    mesh : fitted mesh
    target : the surface to which it is fitted
    """
    found = crossings(mesh)
    if not 0 < len(found) <= MOST or scaled_jacobian(mesh.vertices, mesh.hexes).min() <= 0:
        return mesh
    ends, _ = quad_edges(mesh.quads)
    rows, columns = np.concatenate([ends, ends[:, ::-1]]).T
    number = np.bincount(rows, minlength=len(mesh.vertices))
    # the matrix that averages the neighbours of a vertex on the boundary
    means = csr_matrix((1 / number[rows], (rows, columns)), 2 * (len(mesh.vertices),))
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
    x = untangled(FitProblem(piece, target, samples=1), target.to_unit(piece.vertices), moves[used])
    vertices = mesh.vertices.copy()
    vertices[used[moves[used]]] = target.to_model(x)[moves[used]]
    return replace(mesh, vertices=vertices)
