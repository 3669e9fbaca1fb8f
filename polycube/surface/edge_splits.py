"""Split edges of a triangle mesh, for shorter edges or along planes; the mesh stays conforming."""

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

    Returns vertices, faces, and the old face of each new one.

    chosen : (F,) bool
    level : (V,) the function; vertices with exactly zero are on the cut
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

    The n-th of these edges gets the n-th new vertex. Of two split edges of a face, the shorter
    diagonal between them is used.

    share : (E,) as numbered by `edges`; nan for an edge that is not split

    Returns vertices, faces, and the old face of each new one.
    """
    ends, _, edge = edges(faces)
    is_split = np.isfinite(share)
    middle = np.full(len(ends), -1)
    middle[is_split] = len(vertices) + np.arange(is_split.sum())
    start, end = vertices[ends[is_split]].transpose(1, 0, 2)
    vertices = np.concatenate([vertices, start + share[is_split, None] * (end - start)])
    middle = middle[edge].reshape(-1, 3)
    count = (middle >= 0).sum(axis=1)
    # rotate each face so that a single split edge, or a single one that is not split, is first
    first = np.where(count == 1, (middle >= 0).argmax(axis=1), middle.argmin(axis=1))
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turn, axis=1).T
    m, n, o = np.take_along_axis(middle, turn, axis=1).T
    to_n = np.linalg.norm(vertices[a] - vertices[n], axis=1)
    is_short = to_n < np.linalg.norm(vertices[b] - vertices[o], axis=1)  # diagonal of two splits
    pieces = [
        (0, (a, b, c)),
        (1, (a, m, c)),
        (1, (m, b, c)),
        (2, (a, b, np.where(is_short, n, o))),
        (2, (np.where(is_short, a, b), n, o)),
        (2, (o, n, c)),
        (3, (a, m, o)),
        (3, (m, b, n)),
        (3, (o, n, c)),
        (3, (m, n, o)),
    ]
    made = [np.stack(corners, axis=1)[count == number] for number, corners in pieces]
    parents = [np.flatnonzero(count == number) for number, _ in pieces]
    return vertices, np.concatenate(made), np.concatenate(parents)
