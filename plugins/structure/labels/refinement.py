"""Split edges of a triangle mesh, for shorter edges or along planes; the mesh stays conforming."""

from __future__ import annotations

import numpy as np

from polycube.surface.measures import edges

ROUNDS = 8  # largest number of rounds of halving
MOST = 40000  # faces above which no edge is split


def refined(
    vertices: np.ndarray, faces: np.ndarray, size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices and faces without edges longer than a size, and the old face of each new one."""
    origin = np.arange(len(faces))
    for _ in range(ROUNDS):
        ends, _, edge = edges(faces)
        length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
        edge = edge.reshape(-1, 3)
        longest = np.zeros(len(ends), bool)
        longest[edge[np.arange(len(faces)), length[edge].argmax(axis=1)]] = True
        chosen = longest & (length > size)
        if not chosen.any() or len(faces) > MOST:
            break
        vertices, faces, parent = split(vertices, faces, np.where(chosen, 0.5, np.nan))
        origin = origin[parent]
    return vertices, faces, origin


def cut(
    vertices: np.ndarray, faces: np.ndarray, chosen: np.ndarray, level: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Divide the chosen faces at the zeros of a linear function of the vertices.

    Parameters
    ----------
    chosen : (F,) bool
    level : (V,) the function; vertices with exactly zero are on the cut

    Returns
    -------
    vertices, faces, and the old face of each new one
    """
    ends, _, edge = edges(faces)
    touched = np.zeros(len(ends), bool)
    touched[edge.reshape(-1, 3)[chosen]] = True
    first, second = level[ends].T
    crossed = touched & (first * second < 0)
    share = np.divide(first, first - second, out=np.full(len(ends), np.nan), where=crossed)
    return split(vertices, faces, share)


def split(
    vertices: np.ndarray, faces: np.ndarray, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Insert a vertex on some edges, at a share of the way from the first end to the second.

    share : (E,) as numbered by `edges`; nan for an edge that is not split
    """
    ends, _, edge = edges(faces)
    is_split = np.isfinite(share)
    middle = np.full(len(ends), -1)
    middle[is_split] = len(vertices) + np.arange(is_split.sum())
    start, end = vertices[ends[is_split]].transpose(1, 0, 2)
    vertices = np.concatenate([vertices, start + share[is_split, None] * (end - start)])
    middle = middle[edge].reshape(-1, 3)
    count = (middle >= 0).sum(axis=1)
    parts = [faces[count == 0]]
    parents = [np.flatnonzero(count == 0)]
    for number, cutter in ((1, _one), (2, _two), (3, _three)):
        rows = np.flatnonzero(count == number)
        first = (middle[rows] >= 0).argmax(axis=1) if number == 1 else middle[rows].argmin(axis=1)
        turn = (first[:, None] + np.arange(3)) % 3
        corner = np.take_along_axis(faces[rows], turn, axis=1)
        made = cutter(vertices, corner, np.take_along_axis(middle[rows], turn, axis=1))
        parts += made
        parents += [rows] * len(made)
    return vertices, np.concatenate(parts), np.concatenate(parents)


def _faces(*corners: np.ndarray) -> np.ndarray:
    return np.stack(corners, axis=1)


def _one(vertices: np.ndarray, corner: np.ndarray, middle: np.ndarray) -> list[np.ndarray]:
    """Faces a, b, c with a split edge between a and b."""
    (a, b, c), m = corner.T, middle[:, 0]
    return [_faces(a, m, c), _faces(m, b, c)]


def _two(vertices: np.ndarray, corner: np.ndarray, middle: np.ndarray) -> list[np.ndarray]:
    """Faces a, b, c with split edges except between a and b; shorter diagonal of the quad."""
    (a, b, c), (_, p, q) = corner.T, middle.T
    to_p = np.linalg.norm(vertices[a] - vertices[p], axis=1)
    to_q = np.linalg.norm(vertices[b] - vertices[q], axis=1)
    short = to_p < to_q
    lower = _faces(a, b, np.where(short, p, q))
    upper = _faces(np.where(short, a, b), p, q)
    return [lower, upper, _faces(q, p, c)]


def _three(vertices: np.ndarray, corner: np.ndarray, middle: np.ndarray) -> list[np.ndarray]:
    """Faces with three split edges."""
    (a, b, c), (m, n, o) = corner.T, middle.T
    return [_faces(a, m, o), _faces(m, b, n), _faces(o, n, c), _faces(m, n, o)]
