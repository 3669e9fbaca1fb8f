"""Find the faces of a surface that cross each other.

Boxes of faces are swept along the longest axis; where two overlap, each edge of one face is tested
against the other.  Faces with a common edge and mere contacts do not count.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from polycube.geometry.surface import connected, diagonal
from polycube.types import TriMesh

TOUCH = 1e-10  # of the diagonal: an end this near to a plane is on it
BATCH = 1_000_000  # pairs of boxes looked at together


def self_intersections(surface: TriMesh) -> np.ndarray:
    """(N, 2) pairs of faces that cross, ascending; about F^1.5 work."""
    corners = (surface.vertices - surface.vertices.mean(axis=0)) / diagonal(surface)
    triangles = corners[surface.faces]
    found = [np.empty((0, 2), dtype=np.int64)]
    for pairs in _overlapping_boxes(triangles.min(axis=1), triangles.max(axis=1)):
        first, second = surface.faces[pairs].transpose(1, 0, 2)
        common = (first[:, :, None] == second[:, None, :]).sum(axis=(1, 2))
        pairs = pairs[common < 2]
        found.append(pairs[_cross(triangles[pairs[:, 0]], triangles[pairs[:, 1]])])
    pairs = np.sort(np.concatenate(found), axis=1)
    return pairs[np.lexsort(pairs.T[::-1])]


def crossing_places(surface: TriMesh, pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A face's middle (P, 3) of each place where faces cross, and its pairs (P,), most first.

    pairs : (N, 2) of `self_intersections`; those whose faces have a common vertex are one place
    """
    involved, local = np.unique(pairs, return_inverse=True)
    local, faces = local.reshape(-1, 2), surface.faces[involved]
    n, size = len(involved), len(involved) + len(surface.vertices)
    first = np.concatenate([local[:, 0], np.repeat(np.arange(n), 3)])
    second = np.concatenate([local[:, 1], n + faces.ravel()])
    _, place = np.unique(connected(first, second, size)[:n], return_inverse=True)
    count = np.bincount(place[local[:, 0]])
    middles = surface.vertices[faces].mean(axis=1)
    found = []
    for number in np.argsort(-count, kind="stable"):
        own = middles[place == number]  # the most central: the mean of a ring lies in its hole
        found.append(own[np.linalg.norm(own - own.mean(axis=0), axis=1).argmin()])
    return np.reshape(found, (-1, 3)), -np.sort(-count)


def _overlapping_boxes(low: np.ndarray, high: np.ndarray) -> Iterator[np.ndarray]:
    """Batches (N, 2) of the pairs of (F, 3) boxes that overlap, each pair once."""
    axis = np.argmax(high.max(axis=0) - low.min(axis=0))
    order = np.argsort(low[:, axis], kind="stable")
    low, high = low[order], high[order]
    stop = np.searchsorted(low[:, axis], high[:, axis], side="right")
    n_after = np.maximum(stop - np.arange(len(low)) - 1, 0)  # boxes that begin within each
    batch = np.cumsum(n_after) // BATCH
    for start, end in zip(*_runs(batch), strict=True):
        first = np.repeat(np.arange(start, end), n_after[start:end])
        begin = np.cumsum(n_after[start:end]) - n_after[start:end]
        second = first + 1 + np.arange(len(first)) - np.repeat(begin, n_after[start:end])
        meet = ((low[first] <= high[second]) & (low[second] <= high[first])).all(axis=1)
        yield order[np.stack([first[meet], second[meet]], axis=1)]


def _runs(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each run of equal values starts and ends."""
    cuts = np.flatnonzero(np.diff(values)) + 1
    return np.append(0, cuts), np.append(cuts, len(values))


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(N,) whether an edge of either of (N, 3, 3) triangles passes through the other."""
    crossing = np.zeros(len(first), dtype=bool)
    for one, other in ((first, second), (second, first)):
        for corner in range(3):
            crossing |= _pierces(one[:, corner], one[:, (corner + 1) % 3], other)
    return crossing


def _pierces(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """(N,) whether the segments p q pass through the triangles (N, 3, 3)."""
    a, b, c = np.moveaxis(triangle, 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    height_p, height_q = (np.einsum("ni,ni->n", end - a, normal) for end in (p, q))
    apart = np.minimum(np.abs(height_p), np.abs(height_q)) > TOUCH * area
    hit = apart & (height_p * height_q < 0)
    part = height_p[hit] / (height_p[hit] - height_q[hit])
    point = p[hit] + part[:, None] * (q - p)[hit]
    from_start = point[:, None] - triangle[hit]  # (H, 3, 3) from each corner
    sides = np.cross(np.roll(triangle[hit], -1, axis=1) - triangle[hit], from_start)
    hit[hit] = (np.einsum("hci,hi->hc", sides, normal[hit]) >= 0).all(axis=1)
    return hit
