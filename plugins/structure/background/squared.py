"""Holes across an axis, made square, so that they are stacks of slabs as well.

Four hexes meet the rim of a round hole at each corner of the square: there the hole is smooth, and
each hex has an angle of 60 degrees.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import area_vectors, connected, edges, euler, half_edges, place
from polycube.types import TriMesh

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

HALF = np.sqrt(np.pi) / 2  # half the side of the square with the area of a circle, by its radius
STRAIGHT = 1e-3  # squared sine: tolerance for faces and edges along a hole
ROUND = 0.9  # largest share of the squared normals in one direction for a round face
HIDDEN = 1e-3  # largest share of a ring that is not visible from its centre
BESIDE = 0.1  # of half the width of a hole: largest distance of its upright sides from windows
ALIGNED = 0.15  # of half the height of a hole: difference between heights that become equal
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
    wide : least half width of its square beside the windows, relative to that of the hole
    sides : (2,) heights of the lower and the upper side of the square
    rims : vertices of the loops around it
    windows : vertices of the other loops at its border, where other holes meet it
    """

    faces: np.ndarray
    across: np.ndarray
    middle: np.ndarray
    extent: np.ndarray
    wide: float
    sides: np.ndarray
    rims: list[np.ndarray]
    windows: list[np.ndarray]

    @property
    def width(self) -> float:
        """Half the width of the square."""
        return float(max(HALF, self.wide) * self.extent[0])

    def parts(self, sizes: Sizes) -> int:
        """Number of edges along each side of the square that its roundness requires."""
        return int(np.ceil(sizes.around(float(self.extent.mean())) / 4 - 0.05))

    def levels(self, sizes: Sizes) -> np.ndarray:
        """(N,) heights that divide its upright sides."""
        return np.linspace(self.sides[0], self.sides[1], self.parts(sizes) + 1)[1:-1]

    def fine(self, at: np.ndarray, faces: np.ndarray, sizes: Sizes) -> np.ndarray:
        """(N, 3) places along its other sides, and the length of edges there."""
        places = at[np.unique(faces[self.faces])]
        inner = abs(places @ self.across - self.middle[0]) < INNER * self.width
        length = np.full(inner.sum(), 2 * self.width / self.parts(sizes))
        return np.column_stack([places[inner, :2], length])


def holes_across(surface: TriMesh, at: np.ndarray, pairs: Pairs, numbers: list[int]) -> list[Hole]:
    """The round holes and slots that contain some faces of a surface.

    Sides of their squares at nearly the same height are at the same one, to save thin layers.
    Polygonal passages are left to polycubes, which have fewer hexes there.

    Parameters
    ----------
    at : (V, 3) vertices in a frame whose last axis is upright
    pairs : of half-edges on a common edge, as `twins` finds them
    numbers : CAD faces
    """
    found = list(_holes(surface, at, pairs, numbers))
    if not found:
        return found
    heights = np.concatenate([hole.sides for hole in found])
    order = np.argsort(heights, kind="stable")
    near = ALIGNED * np.repeat([hole.extent[1] for hole in found], 2)[order]
    gap = np.diff(heights[order]) > np.minimum(near[1:], near[:-1])
    group = np.append(0, np.cumsum(gap))
    heights[order] = (np.bincount(group, heights[order]) / np.bincount(group))[group]
    sides = heights.reshape(-1, 2)
    return [hole._replace(sides=own) for hole, own in zip(found, sides, strict=True)]


def _holes(surface: TriMesh, at: np.ndarray, pairs: Pairs, numbers: list[int]) -> Iterator[Hole]:
    vectors = area_vectors(TriMesh(at, surface.faces))
    seen = np.zeros(len(surface.faces), bool)
    for number in numbers:
        own = np.flatnonzero(surface.region == number)
        along = _direction(vectors[own])
        if along is None or seen[own].any():
            continue
        ring = _ring(surface, at, pairs, vectors, along, own)
        seen[ring] = True
        hole = _hole(surface, at, vectors, np.cross([0, 0, 1], along), ring)
        if hole and len(hole.rims) == 2 and euler(surface.faces[ring]) == -len(hole.windows):
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
    if not len(ring):
        return None
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    middle = (low + high) / 2
    normals = np.stack([vectors[ring] @ across, vectors[ring, 2]], axis=1)
    inward = np.einsum("nd,nd->n", middle - places.mean(axis=1), normals)
    if -inward.clip(max=0).sum() > HIDDEN * inward.clip(0).sum():
        return None
    for number in np.unique(surface.region[ring]):
        own = normals[surface.region[ring] == number]
        if np.linalg.norm(own.sum(axis=0)) < ROUND * np.linalg.norm(own, axis=1).sum():
            loops = _loops(surface.faces[ring])
            turns = [_turn(flat[loop] - middle) for loop in loops]
            rims, windows = (
                [loop for loop, turn in zip(loops, turns, strict=True) if bool(turn) == is_round]
                for is_round in (True, False)
            )
            extent = (high - low) / 2
            seen = np.concatenate([np.zeros((0, 2)), *(flat[loop] for loop in windows)])
            wide = abs(seen[:, 0] - middle[0]).max(initial=0) / extent[0]
            wide += min(BESIDE, (1 - wide) / 2)
            sides = middle[1] + HALF * extent[1] * np.array([-1, 1])
            return Hole(ring, across, middle, extent, wide, sides, rims, windows)
    return None


def _loops(faces: np.ndarray) -> list[np.ndarray]:
    """Vertices of the loops at the border of triangles."""
    ends, number, _ = edges(faces)
    border = ends[number == 1]
    return [vertices_of(border, chain)[:-1] for chain in chains_of(border)]


def _turn(places: np.ndarray) -> int:
    """Number of turns of a loop (N, 2) about the origin."""
    angle = np.arctan2(places[:, 1], places[:, 0])
    return round(
        ((np.diff(angle, append=angle[0]) + np.pi) % (2 * np.pi) - np.pi).sum() / np.pi / 2
    )


def square(surface: TriMesh, at: np.ndarray, hole: Hole) -> np.ndarray:
    """Make a hole square in place.

    Its level sides are wider if windows are. Vertices between two sides are moved to the edge
    between them, and the vertices of rims along the upright walls that the hole meets.

    Parameters
    ----------
    at : (V, 3) vertices in the frame

    Returns
    -------
    (N,) the side of each triangle of the hole: 0 and 2 upright, 1 the upper and 3 the lower one

    Raises
    ------
    NoBackgroundError
        If a window is as wide as the hole.
    """
    used, local = np.unique(surface.faces[hole.faces], return_inverse=True)
    local = local.reshape(-1, 3)
    before = np.stack([at[used] @ hole.across, at[used, 2]], axis=1)
    x, y = ((before - hole.middle) / hole.extent).T
    edge = np.arccos(np.clip(hole.wide, np.sqrt(0.5), 1))
    # the same angle in the first quadrant, where the edge between two sides comes to 45 degrees
    turn = np.interp(np.arctan2(abs(y), abs(x)), [0, edge, np.pi / 2], [0, np.pi / 4, np.pi / 2])
    angle = np.arctan2(np.sign(y) * np.sin(turn), np.sign(x) * np.cos(turn))
    share = (angle / (np.pi / 2) + 0.5) % 4  # number of sides up to a vertex
    unit = np.exp(np.pi / 2 * 1j * share)
    side = np.floor(np.angle(unit[local].sum(axis=1)) / (np.pi / 2) % 4).astype(np.int64) % 4
    on_side = np.zeros((len(used), 4), bool)
    on_side[local.ravel(), np.repeat(side, 3)] = True
    first = np.where(on_side[:, 0] & on_side[:, 3], 3, on_side.argmax(axis=1))
    beyond = np.clip((share - first + 2) % 4 - 2, 0, 1)
    share = first + np.where(on_side.sum(axis=1) > 1, 1, beyond)
    half, (low, high) = hole.width, hole.sides
    corner = np.array([[half, low], [half, high], [-half, high], [-half, low], [half, low]])
    flat = np.stack([np.interp(share, np.arange(5), corner[:, d]) for d in (0, 1)], axis=1)
    flat[:, 0] += hole.middle[0]
    along = at[used] @ np.cross(hole.across, [0, 0, 1])
    for rim in (np.searchsorted(used, loop) for loop in hole.rims):
        known = rim[np.argsort(before[rim, 0], kind="stable")]
        along[rim] = np.interp(flat[rim, 0], before[known, 0], along[known])
    for window in (np.searchsorted(used, loop) for loop in hole.windows):
        if hole.wide >= 1 or on_side[window][:, ::2].any():
            where = place(surface, surface.vertices[used[window[0]]])
            raise NoBackgroundError(f"holes meet at their sides near {where}")
        flat[window, 0] = before[window, 0]
    at[used] = np.column_stack([flat[:, :1] * hole.across[:2], flat[:, 1]])
    at[used] += np.multiply.outer(along, np.cross(hole.across, [0, 0, 1]))
    return side
