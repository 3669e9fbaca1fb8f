"""Holes across an axis, made square, so that they are stacks of slabs as well.

Four hexes meet the rim of a round hole at each corner of the square: there the hole is smooth, and
each hex has an angle of 60 degrees.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from polycube.surface.measures import area_vectors, connected, euler, half_edges
from polycube.types import TriMesh

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

HALF = np.sqrt(np.pi) / 2  # half the side of the square with the area of a circle, by its radius
STRAIGHT = 1e-3  # squared sine: tolerance for faces and edges along a hole
ROUND = 0.9  # largest share of the squared normals in one direction for a round face
HIDDEN = 1e-3  # largest share of a ring that is not visible from its centre
INNER = 0.7  # of half a side: its part in which edges have a length of their own

Pairs = tuple[np.ndarray, np.ndarray]


class Hole(NamedTuple):
    """A ring of faces along a direction across the upright axis, which surrounds no material.

    Parameters
    ----------
    faces : (N,) its triangles
    across : (3,) unit vector, perpendicular to its direction and to the upright axis
    middle : (2,) its centre: along `across`, and the height
    extent : (2,) half its width and half its height
    """

    faces: np.ndarray
    across: np.ndarray
    middle: np.ndarray
    extent: np.ndarray

    def parts(self, sizes: Sizes) -> int:
        """Number of edges along each side of the square that its roundness requires."""
        return int(np.ceil(sizes.around(float(self.extent.mean())) / 4 - 0.05))

    def levels(self, sizes: Sizes) -> np.ndarray:
        """(N,) heights that divide its upright sides."""
        number = self.parts(sizes)
        share = 2 * np.arange(1, number) / number - 1
        return self.middle[1] + HALF * self.extent[1] * share

    def fine(self, at: np.ndarray, faces: np.ndarray, sizes: Sizes) -> np.ndarray:
        """(N, 3) places along its other sides, and the length of edges there."""
        places, half = at[np.unique(faces[self.faces])], HALF * self.extent[0]
        inner = abs(places @ self.across - self.middle[0]) < INNER * half
        length = np.full(inner.sum(), 2 * half / self.parts(sizes))
        return np.column_stack([places[inner, :2], length])


def holes_across(
    surface: TriMesh, at: np.ndarray, pairs: Pairs, numbers: list[int]
) -> Iterator[Hole]:
    """The round holes and slots that contain some faces of a surface.

    Polygonal passages are left to polycubes, which have fewer hexes there.

    Parameters
    ----------
    at : (V, 3) vertices in a frame whose last axis is upright
    pairs : of half-edges on a common edge, as `twins` finds them
    numbers : CAD faces
    """
    vectors = area_vectors(TriMesh(at, surface.faces))
    seen = np.zeros(len(surface.faces), bool)
    for number in numbers:
        own = np.flatnonzero(surface.region == number)
        along = _direction(vectors[own])
        if along is None or seen[own].any():
            continue
        ring = _ring(surface, at, pairs, vectors, along, own)
        seen[ring] = True
        if euler(surface.faces[ring]) == 0:
            across = np.cross([0, 0, 1], along)
            hole = _hole(surface, at, vectors, across, ring)
            if hole is not None:
                yield hole


def _direction(vectors: np.ndarray) -> np.ndarray | None:
    """(3,) direction across the upright axis along a face with some area vectors (N, 3)."""
    area = np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)
    spread, axes = np.linalg.eigh((vectors / area[:, None]).T @ vectors / area.sum())
    along = axes[:, 0] if spread[1] > STRAIGHT else np.cross([0, 0, 1], axes[:, 2])
    if spread[0] > STRAIGHT or along[2] ** 2 > STRAIGHT:
        return None
    return np.array([*along[:2], 0]) / np.linalg.norm(along[:2])


def _ring(
    surface: TriMesh,
    at: np.ndarray,
    pairs: Pairs,
    vectors: np.ndarray,
    along: np.ndarray,
    own: np.ndarray,
) -> np.ndarray:
    """(N,) triangles of the faces along a direction that are connected by edges along it."""
    area = np.linalg.norm(vectors, axis=1)
    size = np.bincount(surface.region, area)
    lean = np.bincount(surface.region, (vectors @ along) ** 2 / np.maximum(area, 1e-300))
    is_along = (lean < STRAIGHT * size)[surface.region]
    one, two = pairs
    step = np.diff(at[half_edges(surface.faces)[one]], axis=1)[:, 0]
    square = (step**2).sum(axis=1)
    joins = surface.region[one // 3] == surface.region[two // 3]
    joins |= (square - (step @ along) ** 2) < STRAIGHT * square
    joins &= is_along[one // 3] & is_along[two // 3]
    piece = connected(one[joins] // 3, two[joins] // 3, len(surface.faces))
    return np.flatnonzero(np.isin(piece, piece[own]) & is_along)


def _hole(
    surface: TriMesh, at: np.ndarray, vectors: np.ndarray, across: np.ndarray, ring: np.ndarray
) -> Hole | None:
    """The hole inside a ring of faces, if one is curved and all are visible from its centre."""
    flat = np.stack([at @ across, at[:, 2]], axis=1)
    places = flat[surface.faces[ring]]
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    middle = (low + high) / 2
    normals = np.stack([vectors[ring] @ across, vectors[ring, 2]], axis=1)
    inward = np.einsum("nd,nd->n", middle - places.mean(axis=1), normals)
    if -inward.clip(max=0).sum() > HIDDEN * inward.clip(0).sum():
        return None
    for number in np.unique(surface.region[ring]):
        own = normals[surface.region[ring] == number]
        if np.linalg.norm(own.sum(axis=0)) < ROUND * np.linalg.norm(own, axis=1).sum():
            return Hole(ring, across, middle, (high - low) / 2)
    return None


def square(at: np.ndarray, faces: np.ndarray, hole: Hole) -> np.ndarray:
    """Make a hole square in place.

    Vertices between two sides are moved to the edge between them.

    Parameters
    ----------
    at : (V, 3) vertices in the frame
    faces : (F, 3) triangles of the surface

    Returns
    -------
    (N,) the side of each triangle of the hole: 0 and 2 upright, 1 the upper and 3 the lower one
    """
    used, local = np.unique(faces[hole.faces], return_inverse=True)
    local = local.reshape(-1, 3)
    x, y = ((at[used] @ hole.across, at[used, 2]) - hole.middle[:, None]) / hole.extent[:, None]
    share = (np.arctan2(y, x) / (np.pi / 2) + 0.5) % 4  # number of sides up to a vertex
    turn = np.exp(np.pi / 2 * 1j * share)
    side = np.floor(np.angle(turn[local].sum(axis=1)) / (np.pi / 2) % 4).astype(np.int64) % 4
    on_side = np.zeros((len(used), 4), bool)
    on_side[local.ravel(), np.repeat(side, 3)] = True
    first = np.where(on_side[:, 0] & on_side[:, 3], 3, on_side.argmax(axis=1))
    beyond = np.clip((share - first + 2) % 4 - 2, 0, 1)
    share = first + np.where(on_side.sum(axis=1) > 1, 1, beyond)
    corner = np.array([[1, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]])
    flat = np.stack([np.interp(share, np.arange(5), corner[:, d]) for d in (0, 1)], axis=1)
    flat = hole.middle + HALF * hole.extent * flat
    at[used] += np.multiply.outer(flat[:, 0] - at[used] @ hole.across, hole.across)
    at[used, 2] = flat[:, 1]
    return side
