"""Round holes across an axis, made square, so that they are stacks of slabs as well.

Four hexes meet the rim of such a hole at each corner of the square: there the hole is smooth, and
each hex has an angle of 60 degrees.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from polycube.surface.measures import area_vectors
from polycube.types import TriMesh

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

HALF = np.sqrt(np.pi) / 2  # half the side of the square with the area of a circle, by its radius
ROUND = 1e-3  # of the radius: tolerance for equal cylinders
STRAIGHT = 1e-3  # largest share of the squared normals along the axis of a cylinder
INNER = 0.7  # of half a side: its part in which edges have a length of their own
OPEN = np.radians(46)  # largest turn between two generatrices of a whole cylinder: eight facets


class Hole(NamedTuple):
    """A whole cylinder that surrounds no material, along an axis across the upright one.

    Parameters
    ----------
    faces : (N,) its triangles
    across : (3,) unit vector, perpendicular to both axes
    middle : (2,) place of its axis: along `across`, and the height
    radius : of the cylinder
    """

    faces: np.ndarray
    across: np.ndarray
    middle: np.ndarray
    radius: float

    def parts(self, sizes: Sizes) -> int:
        """Number of edges along each side of the square."""
        return int(np.ceil(sizes.around(self.radius) / 4 - 0.05))

    def levels(self, sizes: Sizes) -> np.ndarray:
        """(N,) heights that divide its upright sides."""
        number = self.parts(sizes)
        share = 2 * np.arange(1, number) / number - 1
        return self.middle[1] + HALF * self.radius * share

    def fine(self, at: np.ndarray, faces: np.ndarray, sizes: Sizes) -> np.ndarray:
        """(N, 3) places along its other sides, and the length of edges there."""
        places = at[np.unique(faces[self.faces])]
        half = HALF * self.radius
        inner = abs(places @ self.across - self.middle[0]) < INNER * half
        length = np.full(inner.sum(), 2 * half / self.parts(sizes))
        return np.column_stack([places[inner, :2], length])


def holes_across(surface: TriMesh, at: np.ndarray, numbers: list[int]) -> Iterator[Hole]:
    """The holes among some faces of a surface.

    Parameters
    ----------
    at : (V, 3) vertices in a frame whose last axis is upright
    numbers : CAD faces
    """
    found: list[Hole] = []
    for number in numbers:
        own = np.flatnonzero(surface.region == number)
        piece = _cylinder(at, surface.faces[own], own)
        if piece is None:
            continue
        for k, other in enumerate(found):
            aligned = abs(piece.across @ other.across) > 1 - ROUND
            sign = np.sign(piece.across @ other.across)
            off = np.linalg.norm(other.middle - piece.middle * [sign, 1])
            unequal = abs(piece.radius - other.radius)
            same = max(float(off), unequal) < ROUND * other.radius
            if aligned and same:
                found[k] = other._replace(faces=np.append(other.faces, own))
                break
        else:
            found.append(piece)
    for hole in found:
        turn = np.sort(_angles(at[np.unique(surface.faces[hole.faces])], hole))
        if float(np.diff(turn, append=turn[0] + 2 * np.pi).max()) < OPEN:
            yield hole


def _cylinder(at: np.ndarray, faces: np.ndarray, own: np.ndarray) -> Hole | None:
    """The cylinder of a face without its extent, if it is concave and across the upright axis."""
    vectors = area_vectors(TriMesh(at, faces))
    area = np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)
    spread, axes = np.linalg.eigh((vectors / area[:, None]).T @ vectors / area.sum())
    along = axes[:, 0]
    if spread[0] > STRAIGHT or spread[1] < 0.1 or abs(along[2]) > ROUND:
        return None
    across = np.cross([0, 0, 1], along / np.linalg.norm(along[:2]))
    used = at[np.unique(faces)]
    flat = np.stack([used @ across, used[:, 2]], axis=1)
    origin = flat.mean(axis=0)
    flat -= origin
    right = (flat**2).sum(axis=1)
    (x, y, rest), *_ = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), right)
    radius = float(np.sqrt(max(rest + x * x + y * y, 0)))
    off = np.linalg.norm(flat - [x, y], axis=1) - radius
    middle = origin + np.array([x, y])
    centres = at[faces].mean(axis=1)
    out = np.stack([centres @ across, centres[:, 2]], axis=1) - middle
    inward = (vectors @ across) * out[:, 0] + vectors[:, 2] * out[:, 1]
    if abs(off).max() > ROUND * radius or inward.sum() > 0:
        return None
    return Hole(own, across, middle, radius)


def _angles(places: np.ndarray, hole: Hole) -> np.ndarray:
    """(N,) angles round the axis of a hole, from the direction across."""
    x, y = places @ hole.across - hole.middle[0], places[:, 2] - hole.middle[1]
    return np.arctan2(y, x)


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
    share = (_angles(at[used], hole) / (np.pi / 2) + 0.5) % 4  # number of sides up to a vertex
    turn = np.exp(np.pi / 2 * 1j * share)
    side = np.floor(np.angle(turn[local].sum(axis=1)) / (np.pi / 2) % 4).astype(np.int64) % 4
    on_side = np.zeros((len(used), 4), bool)
    on_side[local.ravel(), np.repeat(side, 3)] = True
    first = np.where(on_side[:, 0] & on_side[:, 3], 3, on_side.argmax(axis=1))
    beyond = np.clip((share - first + 2) % 4 - 2, 0, 1)
    share = first + np.where(on_side.sum(axis=1) > 1, 1, beyond)
    corner = np.array([[1, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]])
    flat = np.stack([np.interp(share, np.arange(5), corner[:, d]) for d in (0, 1)], axis=1)
    flat = hole.middle + HALF * hole.radius * flat
    at[used] += np.multiply.outer(flat[:, 0] - at[used] @ hole.across, hole.across)
    at[used, 2] = flat[:, 1]
    return side
