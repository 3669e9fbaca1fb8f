"""Faces that are neither across an axis nor along it, and their borders at constant heights."""

from typing import NamedTuple, NoReturn

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import half_edges, place
from polycube.types import TriMesh

LEVEL = 1e-2  # largest slope of a curve at constant height


class Border(NamedTuple):
    """A curve at constant height along a face.

    Parameters
    ----------
    vertices : (N,) in order; the last is the first if it is a loop
    beyond : (N - 1,) the face on the other side of each edge
    """

    vertices: np.ndarray
    beyond: np.ndarray


class Leaning(NamedTuple):
    """A face that is neither a cap nor a wall.

    Parameters
    ----------
    faces : (N, 3) its triangles
    borders : one or two curves at constant height, the lower one first
    sides : (N,) vertices of each curve from one border to the other
    """

    faces: np.ndarray
    borders: tuple[Border, ...]
    sides: tuple[np.ndarray, ...]


def leaning(
    surface: TriMesh, at: np.ndarray, beyond: np.ndarray, number: int, near: float
) -> Leaning:
    """The borders of a face, in a frame whose last axis is upright."""
    own = surface.region == number
    other = beyond.reshape(-1, 3)[own].ravel()
    ends, other = half_edges(surface.faces[own])[other != number], other[other != number]
    rise = abs(np.diff(at[ends, 2], axis=1)[:, 0])
    run = np.linalg.norm(np.diff(at[ends, :2], axis=1)[:, 0], axis=1)
    is_level = (rise < 10 * near) & (rise < LEVEL * run)
    borders = [
        Border(vertices_of(ends[is_level], chain), other[is_level][np.array(chain) // 2])
        for chain in chains_of(ends[is_level])
    ]
    sides = tuple(vertices_of(ends[~is_level], chain) for chain in chains_of(ends[~is_level]))
    uneven = any(np.ptp(at[border.vertices, 2]) > 10 * near for border in borders)
    if uneven or len(sides) != sum(not is_loop(border.vertices) for border in borders):
        _refuse(surface, own)
    if len(borders) not in (1, 2) or (len(borders) == 1 and sides):
        _refuse(surface, own)
    borders.sort(key=lambda border: at[border.vertices, 2].mean())
    return Leaning(surface.faces[own], tuple(borders), sides)


def _refuse(surface: TriMesh, own: np.ndarray) -> NoReturn:
    where = place(surface, surface.vertices[surface.faces[own]].mean(axis=(0, 1)))
    raise NoBackgroundError(
        f"a face leans, and has no two borders at constant heights, near {where}"
    )


def is_loop(vertices: np.ndarray) -> bool:
    """Whether a line returns to its first vertex."""
    return bool(vertices[0] == vertices[-1])
