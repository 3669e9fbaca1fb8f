"""The faces of the CAD model on the boundary of a hex mesh.

Each quad has nine sample points, one at the centre of each ninth. A sample takes the CAD face of
the closest triangle with a compatible normal. Sides of quads that lie on a curve between two faces
also determine the face of the quad (`polycube.surface.curves.cad_curves`). If mesh edges follow the
curves, each CAD face becomes a set of whole quads with exactly its border; otherwise the border is
the shortest one that agrees with the samples.
"""

import logging
from dataclasses import replace
from functools import lru_cache

import numpy as np

from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.face_groups import ends_and_holes
from polycube.hexmesh.named_sets import boundary_sets, cad_faces, cad_sets, patch_sets
from polycube.surface.curves.cad_curves import bounded_faces
from polycube.surface.fit_target import ALPHA, target
from polycube.surface.measures import twins, unit
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

BORDER = 0.2  # of a quad: cost of a side between two faces away from curves
# for the normals of quads at sides where the mesh has no sharp edge
SMOOTH = np.cos(np.radians(30))
SPREAD = 0.003  # of the diagonal: how much farther than the surface the CAD face of a quad may be
TINY = 1e-9
NINTHS = np.array([(u, v) for v in (1 / 6, 1 / 2, 5 / 6) for u in (1 / 6, 1 / 2, 5 / 6)])


def with_sets(mesh: HexMesh, surface: TriMesh) -> HexMesh:
    """The mesh with all sets of its boundary: ends, holes, CAD faces and patches.

    In a CAD model, ends and holes consist of CAD faces and are found on the model. In other parts
    they consist of pieces of the patches of the mesh.
    """
    mesh = replace(mesh, unit=surface.unit)
    if not len(surface.region):
        return replace(mesh, sets=boundary_sets(mesh))
    region, share = quad_regions(mesh, surface)
    numbers = np.unique(surface.region)
    bare = np.setdiff1d(numbers, region)
    on_mesh, several = len(numbers) - len(bare), (share < 1).sum()
    without = f"; without a quad: {', '.join(map(str, bare))}" if len(bare) else ""
    message = "CAD faces: %d of %d on the mesh, %d of %d quads are on several%s"
    logger.info(message, on_mesh, len(numbers), several, len(region), without)
    known = cad_sets(surface)
    found = {n: np.flatnonzero(np.isin(region, own)) for n, own in known.numbers.items()}
    sets = {name: own for name, own in found.items() if len(own)}
    edges, pair = quad_edges(mesh.quads)
    sides = np.sort(region[pair], axis=1)[:, None]
    found = {  # vertices on the borders between CAD faces
        name: np.unique(edges[(sides == np.sort(pairs, axis=1)).all(axis=2).any(axis=1)])
        for name, pairs in known.edges.items()
    }
    on_edges = {name: own for name, own in found.items() if len(own)}
    return replace(
        mesh,
        sets=sets | patch_sets(mesh.patch),
        cad_face=region,
        cad_names={n: known.names[n] for n in (*sets, *on_edges) if n in known.names},
        node_sets=on_edges,
        name=surface.name,
    )


@lru_cache(maxsize=2)
def model_sets(surface: TriMesh) -> dict[str, np.ndarray]:
    """Find the sets of a surface that can be named without a mesh.

    Returns numbers of triangles (N,) by name: ends, holes, and the faces of a CAD model.
    """
    if not len(surface.region):
        label = np.zeros(len(surface.faces), np.int64)
        return ends_and_holes(surface.vertices, surface.faces, label)
    found = cad_sets(surface).numbers
    return {n: np.flatnonzero(np.isin(surface.region, own)) for n, own in found.items()}


def quads_of_sets(mesh: HexMesh, surface: TriMesh) -> dict[str, np.ndarray]:
    """Boundary quads (N,) of a mesh close to the surface, by the names of `model_sets`."""
    if len(surface.region):
        sets = (mesh if mesh.sets else with_sets(mesh, surface)).sets
        return {name: sets.get(name, np.zeros(0, np.int64)) for name in model_sets(surface)}
    sets = model_sets(surface)
    named = np.ones(len(surface.faces), np.int64)
    for number, own in enumerate(sets.values(), start=2):
        named[own] = number  # no triangle is in two of the sets
    region = quad_regions(mesh, surface, named)[0]
    return {name: np.flatnonzero(region == number) for number, name in enumerate(sets, start=2)}


def quad_regions(
    mesh: HexMesh, surface: TriMesh, named: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """CAD face of each boundary quad (Q,), and the share of its samples on this face (Q,).

    named : other regions of the triangles (F,) instead of the CAD faces, numbered from 1
    """
    named = surface.region if named is None else named
    goal = target(surface)
    corners = goal.to_unit(mesh.vertices)[mesh.quads]
    points, normals = _ninths(corners)
    _, face = goal.closest(points, np.repeat(normals, len(NINTHS), axis=0), ALPHA)
    found = named[face].reshape(-1, len(NINTHS))
    bounded = bounded_faces(goal, named, corners, normals)
    other = np.arange(mesh.quads.size)  # the other side at the edge of each side; or itself
    first, second = twins(mesh.quads)
    other[first], other[second] = second, first
    across = other.reshape(-1, 4)
    is_smooth = np.einsum("qd,qkd->qk", normals, normals[across // 4]) > SMOOTH
    region = _with_short_borders(found, bounded, across, corners, is_smooth)
    return region, (found == region[:, None]).mean(axis=1)


def unique_cad_faces(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(Q,) number of the CAD face to which the whole quad is close.

    It is 0 without sets of CAD faces, and for quads that cover several faces.
    """
    goal, face = target(surface), cad_faces(mesh)
    points, normals = _ninths(goal.to_unit(mesh.vertices)[mesh.quads])
    facing = np.repeat(normals, len(NINTHS), axis=0)
    charts = np.repeat(face, len(NINTHS)), None
    feet = (goal.closest(points, facing, ALPHA, cad_face=chart)[0] for chart in charts)
    off = [np.linalg.norm(points - foot, axis=1) for foot in feet]
    return np.where((off[0] - off[1] < SPREAD).reshape(-1, len(NINTHS)).all(axis=1), face, 0)


def _ninths(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres of the ninths (9 Q, 3) and unit normals (Q, 3) of quads with corners (Q, 4, 3)."""
    u, v = NINTHS.T
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])  # (4, 9)
    points = np.einsum("kg,qkd->qgd", shape, corners).reshape(-1, 3)
    return points, unit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))


def _with_short_borders(
    ninths: np.ndarray,
    bounded: np.ndarray,
    across: np.ndarray,
    corners: np.ndarray,
    is_smooth: np.ndarray,
) -> np.ndarray:
    """(Q,) CAD faces that agree with samples and sides, with short borders away from curves.

    ninths : (Q, 9) closest face for the centre of each ninth
    bounded : (Q, 4) face that each side bounds; 0 if it is not on a curve
    across : (Q, 4) the other side at the same edge, as 4 quad + corner
    corners : (Q, 4, 3) corners of the quads
    is_smooth : (Q, 4) sides at which the mesh has no sharp edge, so that a border has a cost

    The result minimises the sum over the quads of the share of their ninths on other faces, the
    share of their perimeter that bounds other faces, and `BORDER` times the lengths of the smooth
    sides between different faces away from curves, divided by the mean side of the two quads. In
    each step, the quads change whose gain is larger than those of their neighbours, so the sum
    decreases.
    """
    is_curve = bounded > 0
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    size = length.mean(axis=1)
    weight = 2 * length / (size[:, None] + size[across // 4]).clip(TINY)
    weight *= BORDER * (is_smooth & ~is_curve & ~is_curve.ravel()[across])
    # at a tie, the centre decides
    candidates = np.hstack([ninths[:, [len(NINTHS) // 2]], ninths, bounded])
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
