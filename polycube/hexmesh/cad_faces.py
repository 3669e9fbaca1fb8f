"""The faces of the CAD model on the boundary of a hex mesh.

Nine points of every quad, one in the middle of each ninth, take the face of the nearest triangle
whose normal suits, and sides that lie on a curve between two faces say which of them the quad is on
(`polycube.surface.curves.cad_curves`).  Where mesh edges follow the curves, each face so becomes a
set of whole quads with exactly its border; elsewhere the border is the shortest that suits the
points.
"""

from __future__ import annotations

import logging
import re
from dataclasses import replace
from functools import lru_cache

import numpy as np

from polycube.hexmesh.face_groups import cad_ends_and_holes, ends_and_holes
from polycube.hexmesh.named_sets import boundary_sets, cad_faces, patch_sets
from polycube.surface.curves.cad_curves import bounded_faces
from polycube.surface.fit_target import target
from polycube.surface.measures import twins
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

BORDER = 0.2  # of a quad: what a side between two faces costs where no curve is
SMOOTH = np.cos(np.radians(30))  # between the normals of quads, where the mesh has no edge
SPREAD = 0.003  # of the diagonal: how much farther than the surface the face of a quad may be
TINY = 1e-9
ALPHA = 0.04  # of the diagonal: how far a normal that is the other way counts
NINTHS = np.array([(u, v) for v in (1 / 6, 1 / 2, 5 / 6) for u in (1 / 6, 1 / 2, 5 / 6)])


def with_sets(mesh: HexMesh, surface: TriMesh) -> HexMesh:
    """The mesh with all sets of its boundary: ends, holes, CAD faces and patches.

    Ends and holes of a CAD model consist of its faces, and are found on the model, those of any
    other part of pieces of the mesh's patches.
    """
    if not len(surface.region):
        return replace(mesh, sets=boundary_sets(mesh))
    region, share = quad_regions(mesh, surface)
    numbers = np.unique(surface.region)
    bare = np.setdiff1d(numbers, region)
    logger.info(
        "CAD faces: %d of %d on the mesh, %d of %d quads are on several%s",
        len(numbers) - len(bare),
        len(numbers),
        (share < 1).sum(),
        len(region),
        f"; without a quad: {', '.join(map(str, bare))}" if len(bare) else "",
    )
    found = {name: np.flatnonzero(np.isin(region, own)) for name, own in _numbers(surface).items()}
    sets = {name: own for name, own in found.items() if len(own)}
    return replace(mesh, sets=sets | patch_sets(mesh.patch))


@lru_cache(maxsize=2)
def model_sets(surface: TriMesh) -> dict[str, np.ndarray]:
    """Find the sets of a surface that have names before there is a mesh.

    Returns
    -------
    Numbers of triangles (N,) by name: ends and holes; for a CAD model its faces, too.
    """
    if not len(surface.region):
        alike = np.zeros(len(surface.faces), np.int64)
        return ends_and_holes(surface.vertices, surface.faces, alike)
    found = _numbers(surface)
    return {n: np.flatnonzero(np.isin(surface.region, own)) for n, own in found.items()}


def quads_of_sets(mesh: HexMesh, surface: TriMesh) -> dict[str, np.ndarray]:
    """Boundary quads (N,) of a mesh near the surface, by the names of `model_sets`."""
    if len(surface.region):
        sets = (mesh if mesh.sets else with_sets(mesh, surface)).sets
        return {name: sets.get(name, np.zeros(0, np.int64)) for name in model_sets(surface)}
    sets = model_sets(surface)
    named = np.ones(len(surface.faces), np.int64)
    for number, own in enumerate(sets.values(), start=2):
        named[own] = number  # no triangle is in two of them
    region = _regions(mesh, surface, named)[0]
    return {name: np.flatnonzero(region == number) for number, name in enumerate(sets, start=2)}


def _numbers(surface: TriMesh) -> dict[str, np.ndarray]:
    """Numbers of the CAD faces of each set: ends, holes, `cad_NAME` of all that the file calls so,
    and `cad_face_1` ...
    """
    numbers = np.unique(surface.region).tolist()
    called: dict[str, list[int]] = {}
    for number, name in enumerate(surface.region_names, start=1):
        if name and number in numbers:
            called.setdefault(f"cad_{re.sub(r'[^0-9A-Za-z]+', '_', name).strip('_')}", []).append(
                number
            )
    each = {name: np.array(own) for name, own in called.items()}
    return cad_ends_and_holes(surface) | each | {f"cad_face_{n}": np.array([n]) for n in numbers}


def quad_regions(mesh: HexMesh, surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
    """CAD face of each boundary quad (Q,), and the share of its points that are on it (Q,)."""
    return _regions(mesh, surface, surface.region)


def _regions(mesh: HexMesh, surface: TriMesh, named: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for any regions of the triangles (F,), from 1."""
    goal = target(surface)
    corners = goal.to_unit(mesh.vertices)[mesh.quads]
    points, normals = _ninths(corners)
    _, face = goal.closest(points, np.repeat(normals, len(NINTHS), axis=0), ALPHA)
    found = named[face].reshape(-1, len(NINTHS))
    bounded = bounded_faces(goal, named, corners, normals)
    across = _across(mesh.quads)
    is_smooth = np.einsum("qd,qkd->qk", normals, normals[across // 4]) > SMOOTH
    region = _with_short_borders(found, bounded, across, corners, is_smooth)
    return region, (found == region[:, None]).mean(axis=1)


def kept_faces(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(Q,) number of the CAD face that all of each boundary quad is near; 0 without sets of CAD
    faces, and for quads that spread over several.
    """
    goal, face = target(surface), cad_faces(mesh)
    points, normals = _ninths(goal.to_unit(mesh.vertices)[mesh.quads])
    facing = np.repeat(normals, len(NINTHS), axis=0)
    off = [
        np.linalg.norm(points - goal.closest(points, facing, ALPHA, cad_face=chart)[0], axis=1)
        for chart in (np.repeat(face, len(NINTHS)), None)
    ]
    is_near = (off[0] - off[1] < SPREAD).reshape(-1, len(NINTHS)).all(axis=1)
    return np.where(is_near, face, 0)


def _ninths(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the ninths (9 Q, 3) and unit normals (Q, 3) of quads with corners (Q, 4, 3)."""
    u, v = NINTHS.T
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])  # (4, 9)
    points = np.einsum("kg,qkd->qgd", shape, corners).reshape(-1, 3)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True).clip(1e-300)


def _with_short_borders(
    ninths: np.ndarray,
    bounded: np.ndarray,
    across: np.ndarray,
    corners: np.ndarray,
    is_smooth: np.ndarray,
) -> np.ndarray:
    """(Q,) CAD faces that suit points and sides, with short borders where no curve is.

    Parameters
    ----------
    ninths : (Q, 9) face that the middle of each ninth is nearest to
    bounded : (Q, 4) face that each side bounds; 0 where it is on no curve
    across : (Q, 4) the other side at the same edge, as 4 quad + corner
    corners : (Q, 4, 3)
    is_smooth : (Q, 4) sides at which the mesh has no edge of its own, where a border costs

    The faces minimise the sum over the quads of the share of their ninths on other faces, the share
    of their perimeter that bounds other faces, and `BORDER` times the lengths of the smooth sides
    between different faces on no curve, over the mean side of the two quads.  In a step, quads
    change that gain more by it than their neighbours would: the sum decreases in every step.
    """
    is_curve = bounded > 0
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    size = length.mean(axis=1)
    weight = 2 * length / (size[:, None] + size[across // 4]).clip(TINY)
    weight *= BORDER * (is_smooth & ~is_curve & ~is_curve.ravel()[across])
    candidates = np.hstack([ninths[:, [len(NINTHS) // 2]], ninths, bounded])  # ties: the middle
    own = (candidates[:, :, None] != ninths[:, None]).mean(axis=2)
    part = is_curve * length / (4 * size[:, None]).clip(TINY)
    own += ((candidates[:, :, None] != bounded[:, None]) * part[:, None]).sum(axis=2)
    own[candidates == 0] = np.inf
    row, beyond = np.arange(len(ninths)), across // 4
    region = candidates[row, own.argmin(axis=1)]
    while True:
        differ = candidates[:, :, None] != region[beyond][:, None]
        cost = own + (weight[:, None] * differ).sum(axis=2)
        best = cost.argmin(axis=1)
        gain = np.where(candidates == region[:, None], cost, np.inf).min(axis=1) - cost[row, best]
        is_first = gain[:, None] > gain[beyond]
        is_first |= (gain[:, None] == gain[beyond]) & (row[:, None] <= beyond)
        moved = (gain > TINY) & is_first.all(axis=1)
        if not moved.any():
            return region
        region = np.where(moved, candidates[row, best], region)


def _across(quads: np.ndarray) -> np.ndarray:
    """(Q, 4) the other side at the edge of each side, as 4 quad + corner; itself without one."""
    found = np.arange(quads.size)
    first, second = twins(quads)
    found[first], found[second] = second, first
    return found.reshape(-1, 4)
