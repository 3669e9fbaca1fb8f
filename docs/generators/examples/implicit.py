"""Solids as functions of a point, negative inside: simple solids, and boolean operations.

Close to its zero level each function is about the distance from the surface, so the sizes of
roundings and blends are lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce

import numpy as np

Field = Callable[[np.ndarray], np.ndarray]  # (N, 3) points -> (N,)
Point = Sequence[float] | np.ndarray


def sphere(center: Point, radius: float) -> Field:
    """Ball."""
    return lambda points: np.linalg.norm(points - center, axis=1) - radius


def box(center: Point, half: Point, rounding: float = 0.0) -> Field:
    """Axis-aligned box with half edges `half` and edges rounded off."""

    def field(points: np.ndarray) -> np.ndarray:
        return _rounded(np.abs(points - center) - half, rounding)

    return field


def cylinder(
    center: Point, axis: int, radius: float, half_height: float, rounding: float = 0.0
) -> Field:
    """Cylinder along a coordinate axis with rounded edges."""

    def field(points: np.ndarray) -> np.ndarray:
        along, across = _split(points - center, axis)
        return _rounded(np.stack([across - radius, np.abs(along) - half_height], axis=1), rounding)

    return field


def torus(center: Point, axis: int, radius: float, thickness: float) -> Field:
    """Torus around a coordinate axis; `thickness` is the radius of its section."""

    def field(points: np.ndarray) -> np.ndarray:
        along, across = _split(points - center, axis)
        return np.hypot(across - radius, along) - thickness

    return field


def turned(axis: int, profile: Sequence[Point]) -> Field:
    """Unbounded solid of revolution from its profile (height along the axis, radius)."""
    heights, radii = np.array(profile).T
    slopes = np.gradient(radii, heights)

    def field(points: np.ndarray) -> np.ndarray:
        along, across = _split(points, axis)
        slope = np.interp(along, heights, slopes)
        return (across - np.interp(along, heights, radii)) / np.hypot(1, slope)

    return field


def capsule(start: Point, end: Point, first: float, last: float) -> Field:
    """Rod with round ends and a radius between `first` and `last`."""
    along = np.subtract(end, start)

    def field(points: np.ndarray) -> np.ndarray:
        part = np.clip((points - start) @ along / (along @ along), 0, 1)
        gap = np.linalg.norm(points - start - part[:, None] * along, axis=1)
        return gap - first - part * (last - first)

    return field


def union(*fields: Field, blend: float = 0.0) -> Field:
    """Union of solids, with fillets of about the width `blend`."""
    return lambda points: reduce(
        lambda a, b: _smooth_minimum(a, b, blend), (field(points) for field in fields)
    )


def difference(field: Field, *holes: Field, blend: float = 0.0) -> Field:
    """The solid without the others, with edges rounded by about `blend`."""
    outside = union(lambda points: -field(points), *holes, blend=blend)
    return lambda points: -outside(points)


def intersection(*fields: Field, blend: float = 0.0) -> Field:
    """Intersection of solids, with edges rounded by about `blend`."""
    return lambda points: (
        -reduce(lambda a, b: _smooth_minimum(a, b, blend), (-field(points) for field in fields))
    )


def _smooth_minimum(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    """Smooth minimum: a parabola below both if they differ by less than `width`."""
    if width == 0:
        return np.minimum(a, b)
    return np.minimum(a, b) - np.maximum(width - np.abs(a - b), 0) ** 2 / (4 * width)


def _rounded(gaps: np.ndarray, rounding: float) -> np.ndarray:
    """Distance from a corner region with the gaps (N, D) beyond straight walls."""
    gaps = gaps + rounding
    return np.linalg.norm(np.maximum(gaps, 0), axis=1) + np.minimum(gaps.max(axis=1), 0) - rounding


def _split(points: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (N,) along an axis and distances (N,) from it."""
    return points[:, axis], np.linalg.norm(np.delete(points, axis, axis=1), axis=1)
