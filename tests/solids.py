"""Small surfaces whose measures are known."""

import numpy as np

from polycube.types import TriMesh


def box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)) -> TriMesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return TriMesh(np.where(corners, high, low), faces)


def torus(n: int = 24, m: int = 12) -> TriMesh:
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = 2 + 0.5 * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), 0.5 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    a, b, c, d = ((i + p) % n * m + (j + q) % m for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    return TriMesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def joined(*parts: TriMesh) -> TriMesh:
    offsets = np.cumsum([0] + [len(part.vertices) for part in parts])
    return TriMesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + o for part, o in zip(parts, offsets, strict=False)]),
    )
