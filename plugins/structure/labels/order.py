"""Order of charts that face each other along an axis, and values that keep distances."""

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.optimize import nnls

from polycube.hexmesh.background.arrangement import cross
from polycube.surface.measures import face_areas, face_normals, half_edges, unit

from .charts import Charts, chart_ends
from .pieces import Pieces

RAYS = 6  # from each chart in each direction
STEEP = 0.3  # smallest outward component of a border along an axis in which pairs are searched

Seen = tuple[int, int, int, float]  # axis, lower group, upper group, distance between them


class Pair(NamedTuple):
    """Two groups of vertices that face each other along an axis."""

    axis: int
    low: int
    high: int
    distance: float  # smallest distance
    weight: float  # sum of the distances of all sight lines


def pairs(pieces: Pieces, charts: Charts) -> list[Pair]:
    """Pairs of groups that face each other along a chart, through the solid or through the outside.

    Irregular borders give the wrong order at some places; of the two orders of a pair, the one with
    the larger sum of distances is used.
    """
    seen: dict[tuple[int, int, int], list[float]] = {}
    for axis, low, high, distance in [*_along(pieces, charts), *_through(pieces, charts)]:
        if low != high:
            seen.setdefault((axis, low, high), []).append(distance)
    return [
        Pair(axis, low, high, min(distances), sum(distances))
        for (axis, low, high), distances in sorted(seen.items())
        if sum(distances) > sum(seen.get((axis, high, low), []))
    ]


def _along(pieces: Pieces, charts: Charts) -> list[Seen]:
    """Pairs of borders and creases of one chart, along the axes of its plane."""
    half, across = chart_ends(pieces, charts)
    corner = half_edges(pieces.surface.faces)[half]
    ends = pieces.surface.vertices[corner]
    inward = unit(np.cross(face_normals(pieces.surface)[half // 3], ends[:, 1] - ends[:, 0]))
    own = charts.chart[half // 3]
    result = []
    for chart in range(len(charts.chart_label)):
        own_edges = np.flatnonzero(own == chart)
        normal = int(charts.chart_label[chart]) // 2
        for axis in ((normal + 1) % 3, (normal + 2) % 3):
            other = 3 - normal - axis
            first, second = charts.group[axis][corner[own_edges]].T
            straight = np.isin(charts.label[across[own_edges] // 3] // 2, [axis, normal])
            group = np.where(straight & (first == second), first, -1)
            rows = _facing(ends[own_edges][:, :, [axis, other]], inward[own_edges, axis], group)
            result += [(axis, int(a), int(b), float(d)) for a, b, d in rows]
    return result


@njit(cache=True)
def _facing(
    ends: np.ndarray, inward: np.ndarray, group: np.ndarray
) -> list[tuple[int, int, float]]:
    """Lower group, upper group and distance of the segments (N, 2, 2) that face each other."""
    found = [(0, 0, 0.0) for _ in range(0)]
    for i in range(len(ends)):
        if group[i] < 0 or abs(inward[i]) < STEEP:
            continue
        x, y = (ends[i, 0] + ends[i, 1]) / 2
        best, at = np.inf, -1
        for j in range(len(ends)):
            low, high = ends[j, 0, 1] - y, ends[j, 1, 1] - y
            if j == i or (low > 0) == (high > 0):
                continue
            distance = ends[j, 0, 0] + low / (low - high) * (ends[j, 1, 0] - ends[j, 0, 0]) - x
            distance = distance if inward[i] > 0 else -distance
            if 1e-9 < distance < best:
                best, at = distance, j
        if at >= 0 and group[at] >= 0:
            if inward[i] > 0:
                found.append((group[i], group[at], best))
            else:
                found.append((group[at], group[i], best))
    return found


def _through(pieces: Pieces, charts: Charts) -> list[Seen]:
    """Pairs of charts with opposite labels, through the solid and through the outside."""
    surface = pieces.surface
    corners = surface.vertices[surface.faces]
    middle, areas = corners.mean(axis=1), face_areas(surface)
    bounds = np.stack([corners.min(axis=1).T, corners.max(axis=1).T])
    result = []
    for chart, label in enumerate(charts.chart_label):
        own_faces = np.flatnonzero(charts.chart == chart)
        chosen = own_faces[np.argsort(-areas[own_faces], kind="stable")]
        chosen = chosen[:: max(1, len(chosen) // RAYS)][:RAYS]
        axis = int(label) // 2
        for direction in (1.0, -1.0):
            for face in chosen.tolist():
                hit, distance = first_hit(corners, bounds, middle[face], axis, direction, face)
                if hit < 0 or charts.label[hit] != label ^ 1:
                    continue
                own = int(charts.chart_group[chart])
                other = int(charts.chart_group[charts.chart[hit]])
                pair = (own, other) if direction > 0 else (other, own)
                result.append((axis, *pair, distance))
    return result


def spaced(
    form: np.ndarray, constants: np.ndarray, low: np.ndarray, high: np.ndarray, least: np.ndarray
) -> np.ndarray | None:
    """Values closest to some constants in a quadratic form, with upper - lower >= least.

    Solved as a least-distance problem (Lawson and Hanson, chapter 23); None if the distances are
    not compatible.
    """
    if not len(low):
        return constants
    rows = np.zeros((len(low), len(constants)))
    rows[np.arange(len(low)), high] += 1
    rows[np.arange(len(low)), low] -= 1
    missing = least - rows @ constants
    if (missing <= 0).all():
        return constants
    root = np.linalg.cholesky(form / np.abs(np.diag(form)).max() + 1e-9 * np.eye(len(form)))
    matrix = np.vstack([np.linalg.solve(root, rows.T), missing])
    goal = np.append(np.zeros(len(form)), 1.0)
    weights, _ = nnls(matrix, goal, maxiter=50 * len(low))
    residual = matrix @ weights - goal
    if np.linalg.norm(residual) < 1e-8:
        return None
    return constants + np.linalg.solve(root.T, -residual[:-1] / residual[-1])


def first_hit(
    corners: np.ndarray, bounds: np.ndarray, origin: np.ndarray, axis: int, sign: float, skip: int
) -> tuple[int, float]:
    """First triangle along an axis from a point, and its distance; -1 if there is none.

    corners, bounds : (F, 3, 3) of the triangles, and their lowest and highest coordinates (2, 3, F)
    skip : triangle that does not count
    """
    across = [(axis + 1) % 3, (axis + 2) % 3]
    (low, high), at = bounds[:, across], origin[across, None]
    near = np.flatnonzero(((low <= at) & (at <= high)).all(axis=0))
    a, b, c = np.moveaxis(corners[near][..., across] - origin[across], 1, 0)
    share = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=1)
    total = share.sum(axis=1)
    is_hit = (share >= 0).all(axis=1) | (share <= 0).all(axis=1)
    is_hit &= (abs(total) >= 1e-18) & (near != skip)
    near, share, total = near[is_hit], share[is_hit], total[is_hit]
    distance = ((share * corners[near, :, axis]).sum(axis=1) / total - origin[axis]) * sign
    distance = np.append(np.inf, np.where(distance > 1e-9, distance, np.inf))
    best = distance.argmin()
    return int(np.append(-1, near)[best]), float(distance[best])
