"""Cells of a planar graph, and the slabs in which each is full."""

from collections.abc import Sequence

import numpy as np

from polycube.hexmesh.background.arrangement import cross, to_lines
from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.surface.measures import connected
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh

PROBES = 5  # number of sample points of each cell
UNDECIDED = 0.3  # winding numbers closer to a half than this are undecided
# distances of possible sample points from an edge, relative to its length
INWARD = (0.02, 0.1, 0.3, 1.0, 3.0)

Loops = tuple[np.ndarray, ...]  # half-edges (N,) of each loop


def cells(
    surface: TriMesh, background: Background, points: np.ndarray, edges: np.ndarray
) -> tuple[list[Loops], np.ndarray]:
    """The cells of the section of a part that are full in at least one slab.

    Half-edge 2 e runs from the lower to the higher end of edge e, 2 e + 1 in the opposite
    direction.

    Returns half-edges of each cell, its outer loop first, with the cell on their left; whether each
    cell is full in each slab (C, K). Raises NoBackgroundError if it is undecided whether a cell is
    full, or if none is.
    """
    loops = loops_of(points, edges)
    area = np.array([loop_area(points, edges, loop) for loop in loops])
    outer = np.flatnonzero(area > 0)
    inner: dict[int, list[np.ndarray]] = {number: [] for number in outer.tolist()}
    outer = outer[np.argsort(area[outer])]
    corners = [points[ends(edges, loops[number])].reshape(-1, 2) for number in outer.tolist()]
    low, high = (np.array([end(c, axis=0) for c in corners]) for end in (np.min, np.max))
    for number in np.flatnonzero(area < 0).tolist():
        place = points[ends(edges, loops[number][:1])].mean(axis=1)
        for other in outer[((low <= place) & (place <= high)).all(axis=1)].tolist():
            if np.isin(loops[number] // 2, loops[other] // 2).any():
                continue  # they have a common edge
            a, b = np.moveaxis(points[ends(edges, loops[other])] - place, 1, 0)
            if np.arctan2(cross(a, b), (a * b).sum(axis=1)).sum() > np.pi:
                inner[other].append(loops[number])
                break
    found = [(loops[number], *inner[number]) for number in outer.tolist()]
    share = _shares(surface, background, points, edges, found)
    if (abs(share - 0.5) < UNDECIDED).any():
        raise NoBackgroundError("the full cells of its section cannot be determined")
    full = share > 0.5
    full_cells = np.flatnonzero(full.any(axis=1))
    if not len(full_cells):
        raise NoBackgroundError("no cell of its section is full")
    return [found[number] for number in full_cells], full[full_cells]


def ends(edges: np.ndarray, half: np.ndarray) -> np.ndarray:
    """(N, 2) first and last point of half-edges."""
    return np.where((half % 2)[:, None], edges[half // 2][:, ::-1], edges[half // 2])


def loops_of(points: np.ndarray, edges: np.ndarray) -> list[np.ndarray]:
    """Half-edges around the left side of each, in their order."""
    half = np.arange(2 * len(edges))
    tail = ends(edges, half)
    step = np.diff(points[tail], axis=1)[:, 0]
    order = np.lexsort([np.arctan2(step[:, 1], step[:, 0]), tail[:, 0]])
    # the previous half-edge around the same point is the next one to the left
    first = np.searchsorted(tail[order, 0], tail[order, 0], side="left")
    last = np.searchsorted(tail[order, 0], tail[order, 0], side="right") - 1
    place = np.arange(len(order))
    before = np.empty_like(order)
    before[order] = order[np.where(place == first, last, place - 1)]
    after = before[half ^ 1]
    loop = connected(half, after, len(half))
    found = []
    for start in np.unique(loop, return_index=True)[1].tolist():
        round_it = [start]
        while (here := int(after[round_it[-1]])) != start:
            round_it.append(here)
        found.append(np.array(round_it))
    return found


def loop_area(points: np.ndarray, edges: np.ndarray, loop: np.ndarray) -> float:
    a, b = np.moveaxis(points[ends(edges, loop)], 1, 0)
    return float(cross(a, b).sum() / 2)


def _shares(
    surface: TriMesh,
    background: Background,
    points: np.ndarray,
    edges: np.ndarray,
    loops: Sequence[Loops],
) -> np.ndarray:
    """(C, K) winding numbers of cells in slabs: medians over points well inside of them."""
    middle = (background.levels[1:] + background.levels[:-1]) / 2
    flat = np.stack([_inside(points[ends(edges, np.concatenate(each))]) for each in loops])
    places = np.concatenate(
        [
            np.repeat(flat.reshape(-1, 1, 2), len(middle), axis=1),
            np.broadcast_to(middle[:, None], (flat.shape[0] * PROBES, len(middle), 1)),
        ],
        axis=2,
    )
    found = winding_numbers(surface, background.place(places.reshape(-1, 3)))
    return np.median(found.reshape(len(loops), PROBES, len(middle)), axis=1)


def _inside(lines: np.ndarray) -> np.ndarray:
    """(PROBES, 2) points in the cell on the left of lines (N, 2, 2), the farthest from them."""
    start, step = lines[:, 0], np.diff(lines, axis=1)[:, 0]
    longest = np.argsort(-(step**2).sum(axis=1), kind="stable")[:PROBES]
    left = np.stack([-step[:, 1], step[:, 0]], axis=1)[longest]
    middle = start[longest] + step[longest] / 2
    tried = (middle + np.multiply.outer(INWARD, left)).reshape(-1, 1, 2)
    a, b = start - tried, start + step - tried
    area, along = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(axis=2)
    is_inside = np.arctan2(area, along).sum(axis=1) > np.pi
    gap = to_lines(tried[:, 0], lines)[0].min(axis=1)
    best = np.argsort(np.where(is_inside, -gap, 0), kind="stable")
    return np.resize(tried[best[: min(PROBES, max(1, is_inside.sum()))], 0], (PROBES, 2))
