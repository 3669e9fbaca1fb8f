"""Faces that are neither across an axis nor along it, and their borders at constant heights."""

from typing import NamedTuple

import numpy as np

from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import connected, half_edges, triangle_vectors
from polycube.types import TriMesh

LEVEL = 1e-2  # largest slope of a curve at constant height
STEEP = 0.5  # smallest cosine between the normals of a sloping face and the axis
FEW = 1e-3  # largest share of the area of a sloping face that may be steeper


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
) -> Leaning | None:
    """The borders of a face, in a frame whose last axis is upright; None for other borders."""
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
        return None
    if len(borders) not in (1, 2) or (len(borders) == 1 and sides):
        return None
    borders.sort(key=lambda border: at[border.vertices, 2].mean())
    return Leaning(surface.faces[own], tuple(borders), sides)


def set_flat(
    surface: TriMesh, at: np.ndarray, beyond: np.ndarray, numbers: list[int], is_cap: np.ndarray
) -> list[int]:
    """Set the sloping faces among given ones flat, in place; their numbers.

    A face is sloping if its slope is below 60 degrees everywhere. Sloping faces that meet become
    one plane: at the height of a cap on the same side that they meet, or else at their mean height.

    is_cap : (R,) whether each face is perpendicular to the axis
    """
    vectors = triangle_vectors(at[surface.faces])
    area, up = np.linalg.norm(vectors, axis=1), vectors[:, 2]
    sign = np.sign(np.bincount(surface.region, up, len(is_cap))).astype(np.int64)
    is_steep = sign[surface.region] * up < STEEP * area
    steep = np.bincount(surface.region, area * is_steep, len(is_cap))
    total = np.bincount(surface.region, area, len(is_cap))
    is_sloping = np.isin(np.arange(len(is_cap)), numbers) & (steep < FEW * total)
    own, ends = np.repeat(surface.region, 3), half_edges(surface.faces)
    is_same = sign[own] == sign[beyond]
    joins = is_same & is_sloping[own] & is_sloping[beyond]
    group = connected(own[joins], beyond[joins], len(is_cap))
    for one in np.unique(group[is_sloping]):
        faces = group[surface.region] == one
        fixed = at[ends[is_same & (group[own] == one) & is_cap[beyond]], 2]
        mean = np.average(at[surface.faces[faces], 2].mean(axis=1), weights=area[faces])
        at[surface.faces[faces], 2] = fixed.mean() if len(fixed) else mean
    return np.flatnonzero(is_sloping).tolist()


def is_loop(vertices: np.ndarray) -> bool:
    """Whether a line returns to its first vertex."""
    return bool(vertices[0] == vertices[-1])
