"""Lattice planes of one axis: on the planar faces of the part, evenly spaced between them."""

from itertools import pairwise

import numpy as np

from polycube.surface.measures import face_areas, face_normals
from polycube.types import TriMesh

ALONG = np.cos(np.radians(2))  # for a normal and the axis of its plane
SAME = 0.05  # of a cell: closer planes are merged
NEAREST = 0.6  # of a block: smallest distance of two planes
MIDDLE = 0.2  # of a block: largest distance of an inner plane from the centre
LEAST = 0.25  # of the area of a side of a cell: smallest area of a plane


def planes(surface: TriMesh, axis: int, size: float, doublings: int = 1) -> np.ndarray:
    """Coordinates of the lattice planes perpendicular to an axis.

    Every second plane bounds blocks of two cells, every fourth blocks of four, and so on. Each
    planar face has a plane between the largest blocks, the larger faces first, if no other is
    close, or else one between smaller blocks.

    Parameters
    ----------
    surface : surface in the frame of the lattice
    size : wanted distance of two planes
    doublings : number of levels of smaller blocks and cells within the largest blocks

    Returns
    -------
    (2^doublings N + 1,) ascending, from the lowest point of the surface to the highest
    """
    heights = surface.vertices[:, axis]
    fixed = [float(heights.min()), float(heights.max())]
    places, areas = _faces(surface, axis, SAME * size)
    wide, order = 2**doublings * size, np.argsort(-areas, kind="stable")
    order = order[areas[order] >= LEAST * size**2]
    for number in order:
        gap = min(abs(places[number] - other) for other in fixed)
        if gap >= NEAREST * wide:
            fixed.append(float(places[number]))
    fixed.sort()
    parts = [max(1, round((b - a) / wide)) for a, b in pairwise(fixed)]
    ends = zip(pairwise(fixed), parts, strict=True)
    blocks = [np.linspace(a, b, n, endpoint=False) for (a, b), n in ends]
    lines = np.concatenate([*blocks, fixed[-1:]])
    for _ in range(doublings):
        lines = _halved(lines, places[order])
    return lines


def _halved(lines: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Lines (N,) with one more in each interval: at the centre, or at the first place near it."""
    between = (lines[1:] + lines[:-1]) / 2
    for place in places[::-1]:
        block = np.searchsorted(lines, place) - 1
        if 0 <= block < len(between):
            share = (place - lines[block]) / (lines[block + 1] - lines[block])
            if abs(share - 0.5) < MIDDLE:
                between[block] = place
    return np.sort(np.concatenate([lines, between]))


def _faces(surface: TriMesh, axis: int, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Heights and areas of the planes perpendicular to the axis."""
    flat = abs(face_normals(surface)[:, axis]) > ALONG
    height = surface.vertices[surface.faces[flat], axis].mean(axis=1)
    area = face_areas(surface)[flat]
    order = np.argsort(height)
    height, area = height[order], area[order]
    group = np.cumsum(np.append(0, np.diff(height) > near)) if len(height) else np.zeros(0, int)
    total = np.bincount(group, area)
    return np.bincount(group, area * height) / np.maximum(total, 1e-300), total
