"""Remove flat corners of boundary quads caused by curves of the surface.

If a curve turns on the polycube but not on the part, a quad between it and the adjacent face has an
angle of 180 degrees, and its hex a scaled Jacobian of zero. A triangular pocket has one such quad
on its floor, a round one four. A sheet around the hexes under the face puts two quads there. If
only one corner is flat, a sheet around the quadrant behind it is better: it leaves one quad at each
of the other corners, which a sheet under the face would halve.
"""

import logging
from dataclasses import replace

import numpy as np

from polycube.fitting.creases.constraints import Matching, match, on_crease, on_goals
from polycube.fitting.creases.paths import numbered
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import EDGES, FACES, neighbours, quad_sides, unique_rows
from polycube.hexmesh.generation.sheets import has_sheet, with_sheet
from polycube.surface.fit_target import Target
from polycube.surface.measures import connected, unit
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

FLAT = np.deg2rad(150)  # angle of a quad above which the scaled Jacobian of its hex is below 0.5
ROUNDS = 6  # largest number of rounds; sheets that touch are inserted in sequence
_FACES_OF_EDGE = np.array([[f for f in range(6) if np.isin(e, FACES[f]).all()] for e in EDGES])


def without_flat_corners(
    mesh: HexMesh, target: Target, anywhere: bool = False, keep_paths: bool = False
) -> HexMesh:
    """The mesh with sheets of hexes under faces with flat corners; unchanged if there are none.

    mesh : fitted mesh, with its boundary close to the target, in model units
    anywhere : also where a path of a curve turns inside a patch of the polycube
    keep_paths : whether the mesh keeps the paths for which the sheets are made; otherwise they are
        computed again after each sheet and may turn elsewhere
    """
    for _ in range(ROUNDS):
        problem = FitProblem(mesh, target, samples=1)
        x = target.to_unit(mesh.vertices)
        matching = match(problem, x)
        placed = on_goals(problem, x, matching)
        inside = _disjoint(mesh, _sets(problem, placed, matching, anywhere, not keep_paths))
        if not inside.any():
            break
        before = len(mesh.hexes)
        # vertices on their curves, where the paths are found again
        mesh = with_sheet(replace(mesh, vertices=target.to_model(placed)), inside)
        if keep_paths:
            paths = numbered(matching.routes, target.followed)
            mesh = replace(mesh, paths={str(k): path for k, path in paths.items()})
        logger.info("flat corners: a sheet of %d hexes", len(mesh.hexes) - before)
    return mesh


def _disjoint(mesh: HexMesh, sets: list[np.ndarray]) -> np.ndarray:
    """(H,) union of the sets (H,) that permit a sheet and do not touch an earlier one."""
    inside = np.zeros(len(mesh.hexes), bool)
    used = np.zeros(len(mesh.vertices), bool)
    for own in sets:
        if not used[mesh.hexes[own]].any() and has_sheet(mesh, own):
            inside |= own
            used[mesh.hexes[own]] = True
    return inside


def _sets(
    problem: FitProblem, placed: np.ndarray, matching: Matching, anywhere: bool, may_cross: bool
) -> list[np.ndarray]:
    """Hexes (H,) to shrink: under each face with a flat corner, except those at its other corners.

    may_cross : whether sheets may cross paths; then a face with a single flat corner, at a corner
        of the polycube, gets the quadrant behind it
    """
    mesh, part = problem.mesh, problem.parts(~on_crease(problem, matching))
    flat, sharp = corners(problem, placed, matching, anywhere)
    of_polycube, _ = corners(problem, placed, matching) if anywhere else (flat, sharp)
    owner, face = quad_sides(mesh)
    sets = []
    for number in np.unique(part[flat.any(axis=1)]):
        own = part == number
        sets.append(np.isin(np.arange(len(mesh.hexes)), owner[own & ~sharp]))
        quads, local = np.nonzero(flat & own[:, None])
        if may_cross and len(quads) == 1 and of_polycube[quads[0], local[0]]:
            corner = problem.quads[quads[0], local[0]]
            behind = quadrant(mesh, owner[quads[0]], face[quads[0]], corner)
            if behind is not None and has_sheet(mesh, behind):
                sets[-1] = behind
    return sets


def corners(
    problem: FitProblem, placed: np.ndarray, matching: Matching, anywhere: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Flat corners of quads (Q, 4), and the other quads (Q,) that have a corner of the surface.

    A flat corner has an angle above FLAT between polycube edges that lie on curves and have at
    least two hexes each; with one hex, the layer of `pillow` is used instead.

    placed : (V, 3) with the boundary on the surface and its curves
    anywhere : also between other edges that lie on curves
    """
    key = np.array([len(placed), 1])
    quads, on = problem.quads, on_crease(problem, matching)
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2), axis=2) @ key  # (Q, 4)
    patch = problem.mesh.patch[problem.side_quads]
    wide = on & (problem.side_valence > 1) & (anywhere | (patch[:, 0] != patch[:, 1]))
    is_wide, is_on = (np.isin(sides, problem.sides[each] @ key) for each in (wide, on))
    return corners_between(placed, quads, is_wide, is_on, matching.corner)


def corners_between(
    x: np.ndarray, quads: np.ndarray, wide: np.ndarray, on: np.ndarray, corner: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Flat corners (Q, 4), and the other quads (Q,) that have a corner of the surface.

    wide, on : (Q, 4) sides between which a corner may be flat, and sides on curves
    corner : (P,) vertices at corners of the surface
    """
    direction = unit(x[np.roll(quads, -1, axis=1)] - x[quads])
    is_flat = np.einsum("qkd,qkd->qk", direction, -np.roll(direction, 1, axis=1)) < np.cos(FLAT)
    flat = wide & np.roll(wide, 1, axis=1) & is_flat
    ends = on & np.roll(on, 1, axis=1) & np.isin(quads, corner) & ~is_flat
    return flat, ends.any(axis=1) & ~flat.any(axis=1)


def quadrant(mesh: HexMesh, hex_: int, face: int, corner: int) -> np.ndarray | None:
    """(H,) hexes behind a corner of a boundary quad; None if its faces do not divide the mesh.

    hex_, face : the boundary quad, as a hex and a local face
    corner : vertex of the quad
    """
    faces, number, count = unique_rows(np.sort(mesh.hexes[:, FACES].reshape(-1, 4), axis=1))
    own = number.reshape(-1, 6)[hex_]
    under = np.array([f for f in own if corner in faces[f] and f != own[face]])
    layer = connected(*_opposite(mesh.hexes, number, count), len(faces))
    is_layer = np.isin(layer, layer[under])
    sides, twins = neighbours(mesh.hexes)
    one, two, between = sides // 6, twins // 6, is_layer[number[sides]]
    part = connected(one[~between], two[~between], len(mesh.hexes))
    inside = part == part[hex_]
    beyond = np.isin(number[sides], under) & (inside[one] != inside[two])
    return inside if beyond.sum() == len(under) else None


def _opposite(
    hexes: np.ndarray, number: np.ndarray, count: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces that are opposite at an edge, as in a lattice; none at an irregular edge.

    number : (6 H,) face of each side of a hex; count : (F,) number of hexes of each face
    """
    _, edge, valence = unique_rows(np.sort(hexes[:, EDGES].reshape(-1, 2), axis=1))
    order = np.argsort(edge, kind="stable")
    pairs = number.reshape(-1, 6)[:, _FACES_OF_EDGE].reshape(-1, 2)[order]
    first, second = [], []
    for n_hexes, n_exposed in ((2, 2), (3, 2), (4, 0)):
        ring = pairs[valence[edge[order]] == n_hexes].reshape(-1, n_hexes, 2)
        is_exposed = count[ring] == 1
        regular = is_exposed.sum(axis=(1, 2)) == n_exposed
        ring, is_exposed = ring[regular], is_exposed[regular]
        if n_hexes == 2:
            both = ring[is_exposed].reshape(-1, 2).T
            first.append(both[0])
            second.append(both[1])
            continue
        inner = (~is_exposed).all(axis=2).argmax(axis=1)  # a hex with both faces inside
        total = (ring.sum(axis=(1, 2)) + (ring * is_exposed).sum(axis=(1, 2))) // 2
        for one in ring[np.arange(len(ring)), inner].T:
            is_own = (ring == one[:, None, None]).any(axis=2)
            adjacent = ((ring.sum(axis=2) - one[:, None]) * is_own).sum(axis=1)
            first.append(one)
            second.append(total - one - adjacent)
    return np.concatenate(first), np.concatenate(second)
