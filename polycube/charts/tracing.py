"""Draw lines that never cross on a surface: guided shortest paths along edges.

A path uses only free vertices. After each path, every undrawn edge between two drawn vertices is
halved, so two points of one region can always be connected and lines never block each other. At a
common end, a new line keeps its position in the cyclic order.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from polycube.charts.mapped_surface import Sheet, Sides, sides, split
from polycube.surface.measures import connected, half_edges, shortest_path, twins

Cost = Callable[[Sheet, Sides], np.ndarray]  # (E,) cost of the sides; inf: not permitted
Sector = tuple[int, int] | None


class Drawing:
    """A sheet and the paths drawn on it, each an array of vertices."""

    def __init__(self, sheet: Sheet, taken: Iterable[int]) -> None:
        self.sheet = sheet
        self.paths: dict[int, np.ndarray] = {}
        self.sides = sides(sheet)
        self._taken = np.array(list(taken), np.int64)  # only paths that end there may use them
        self._free_chords()

    def draw(
        self,
        name: int,
        ends: tuple[int, int],
        cost: Cost,
        between: tuple[Sector, Sector] = (None, None),
        least: int = 2,
    ) -> bool:
        """Draw the cheapest free path; returns False if there is none.

        between : for each end, the neighbours between which the path must leave, counter-clockwise;
            None: anywhere
        least : the path must have more edges than this; the edges of a shorter path are halved
        """
        joins, weight = self.sides.ends, cost(self.sheet, self.sides)
        closed = self.taken()
        closed[list(ends)] = False
        usable = np.isfinite(weight) & ~closed[joins].any(axis=1)
        for end, sector in zip(ends, between, strict=True):
            here = np.flatnonzero(usable & (joins == end).any(axis=1))
            usable[here] = np.isin(joins[here].sum(axis=1) - end, self._leaving(end, sector))
        graph = csr_array((weight[usable], tuple(joins[usable].T)), (len(closed), len(closed)))
        path, _ = shortest_path(graph, *ends, directed=False)
        if len(path) == 0:
            return False
        while len(path) <= least + 1:
            path = self._halve(path)
        self.paths[name] = path
        self._taken = np.union1d(self._taken, path)
        self._free_chords()
        return True

    def taken(self) -> np.ndarray:
        """(V,) whether a vertex is on a path or reserved as the end of one."""
        found = np.zeros(len(self.sheet.vertices), bool)
        found[self._taken] = True
        return found

    def drawn(self) -> np.ndarray:
        """(E,) whether each side of the sheet is part of a path."""
        of_path = [np.stack([path[:-1], path[1:]], axis=1) for path in self.paths.values()]
        steps = np.sort(np.concatenate([np.zeros((0, 2), np.int64), *of_path]), axis=1)
        key = np.array([len(self.sheet.vertices), 1])
        return np.isin(self.sides.ends @ key, steps @ key)

    def regions(self, faces: np.ndarray | None = None) -> np.ndarray:
        """(F,) region between the paths for each face (of a mask)."""
        selected = np.arange(len(self.sheet.faces)) if faces is None else np.flatnonzero(faces)
        first, second = twins(self.sheet.faces[selected])
        open_ = ~self.drawn()[self.sides.of_face[selected].ravel()[first]]
        return connected(first[open_] // 3, second[open_] // 3, len(selected))

    def move(self, vertices: np.ndarray, places: np.ndarray) -> None:
        """Set the positions (N, 3) of vertices (N,) on the polycube."""
        moved = self.sheet.places.copy()
        moved[vertices] = places
        self.sheet = replace(self.sheet, places=moved)

    def _leaving(self, vertex: int, between: Sector) -> list[int]:
        """Neighbours of a vertex, counter-clockwise strictly between two of them."""
        faces = self.sheet.faces[(self.sheet.faces == vertex).any(axis=1)]
        after = {a: b for a, b in half_edges(faces).tolist() if vertex not in (a, b)}
        if between is None:
            return list(after)
        found, at = [], after[between[0]]
        while at != between[1]:
            found.append(at)
            at = after[at]
        return found

    def _halve(self, path: np.ndarray) -> np.ndarray:
        """Halve the edges of a path; returns the path with the new vertices."""
        steps = np.sort(np.stack([path[:-1], path[1:]], axis=1), axis=1)
        key, ends = np.array([len(self.sheet.vertices), 1]), self.sides.ends
        where = np.searchsorted(ends @ key, steps @ key)
        marked = np.zeros(len(ends), bool)
        marked[where] = True
        middle = len(self.sheet.vertices) + np.cumsum(marked)[where] - 1
        self._split(marked)
        return np.append(np.stack([path[:-1], middle], axis=1).ravel(), path[-1])

    def _free_chords(self) -> None:
        """Halve the undrawn sides between two taken vertices."""
        chord = self.taken()[self.sides.ends].all(axis=1) & ~self.drawn()
        if chord.any():
            self._split(chord)

    def _split(self, marked: np.ndarray) -> None:
        self.sheet = split(self.sheet, self.sides, marked)
        self.sides = sides(self.sheet)


def near(line: np.ndarray, width: float) -> Cost:
    """Length of each side, times a factor that is 1 on the line and grows with the distance.

    width : distance at which the factor is 2
    """
    start, along = line[0], line[-1] - line[0]

    def cost(sheet: Sheet, sides: Sides) -> np.ndarray:
        share = np.clip((sheet.places - start) @ along / (along @ along), 0, 1)
        factor = 1 + ((sheet.places - start - share[:, None] * along) ** 2).sum(axis=1) / width**2
        return sides.length * factor[sides.ends].mean(axis=1)

    return cost
