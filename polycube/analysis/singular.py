"""Places where the stress of linear elasticity is unbounded, found from the geometry.

At an edge the stress is bounded up to a certain angle inside the solid: 180 degrees if both faces
are free, and about 60 if one is free and the other clamped (Williams 1952). A face that slides in
its plane is a plane of symmetry, so the angle counts twice. Loads on a very small area are treated
as point loads.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polycube.analysis.boundary_sets import trace
from polycube.analysis.constraints import Support
from polycube.spline.bernstein import bernstein, derivative
from polycube.spline.boundary import boundary_nodes
from polycube.types import Spline

FREE, CLAMPED, SLIDING = 200, 65, 100  # degrees above which an edge is singular
ALONG = 0.99  # cosine between the normal of a face and its single constrained component
LINE = (np.arange(4) + 0.5) / 4  # points along an edge


@dataclass(frozen=True, eq=False)
class Singular:
    """An edge or a small loaded area."""

    what: str
    nodes: np.ndarray  # (N,) its Bezier nodes
    points: np.ndarray  # (P, 3) on it


def singular_places(
    spline: Spline, supports: Sequence[Support], loaded: Sequence[np.ndarray], radius: float
) -> list[Singular]:
    """Sharp re-entrant edges, borders of supports, and loads on less area than a disc of a radius.

    loaded : faces (F,), indices of `spline.sides`, of each load
    """
    first, second, lines, points, angle, normals = _edges(spline)

    def along(chosen: np.ndarray, what: str) -> list[Singular]:
        own = np.flatnonzero(chosen)
        found = Singular(what, np.unique(lines[own]), points[own].reshape(-1, 3))
        return [found] if len(own) else []

    found = along(angle > FREE, "sharp inner edge")
    for support in supports:
        is_supported = np.isin(np.arange(len(spline.sides)), support.faces)
        is_border = is_supported[first] != is_supported[second]
        limit = np.full(len(first), CLAMPED)
        if len(support.components) == 1:
            normal = np.where(is_supported[first, None], normals[:, 0], normals[:, 1])
            limit[abs(normal[:, support.components[0]]) > ALONG] = SLIDING
        found += along(is_border & (angle > limit), f"border of {support.name}")
    for faces in loaded:
        here = trace(spline, faces)
        if here.area.sum() < np.pi * radius**2:
            nodes = np.unique(boundary_nodes(spline)[faces])
            found.append(Singular("load on a small area", nodes, here.points))
    return found


def _edges(spline: Spline) -> tuple[np.ndarray, ...]:
    """Edges between two faces of the boundary of the same level.

    Returns
    -------
    The two faces (N,) and (N,), nodes (N, 4), points (N, 4, 3), angle (N,) inside the solid in
    degrees, and the two normals (N, 2, 3).
    """
    nodes = boundary_nodes(spline).reshape(-1, 4, 4)
    sides = [nodes, nodes.swapaxes(1, 2)[:, ::-1], nodes[:, ::-1, ::-1]]
    sides.append(sides[1][:, ::-1, ::-1])
    strips = np.stack([side[:, :2] for side in sides], axis=1).reshape(-1, 2, 4)
    ends = np.sort(strips[:, 0, [0, 3]], axis=1)
    order = np.lexsort(ends.T)
    same = np.flatnonzero((ends[order][1:] == ends[order][:-1]).all(axis=1))
    pairs = np.stack([order[same], order[same + 1]], axis=1)
    points = (spline.extraction @ spline.control)[strips]  # (4 Q, 2, 4, 3)
    along = derivative(LINE) @ points[:, 0]
    inwards = bernstein(LINE) @ (points[:, 1] - points[:, 0])
    normal = _unit(np.cross(along, inwards))
    inwards = _unit(np.cross(normal, along))
    a, b = pairs.T
    turn = inwards[b][:, ::-1]  # the edge has the opposite direction on the other face
    angle = np.arctan2(-(turn * normal[a]).sum(axis=2), (turn * inwards[a]).sum(axis=2))
    return (
        a // 4,
        b // 4,
        strips[a, 0],
        bernstein(LINE) @ points[a, 0],
        np.median(np.degrees(angle) % 360, axis=1),
        _unit(normal[pairs].mean(axis=2)),
    )


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True).clip(np.finfo(float).tiny)
