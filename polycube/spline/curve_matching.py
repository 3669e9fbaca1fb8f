"""Match the edges of a spline between two CAD faces with the curve of the CAD model."""

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.boundary import corner_nodes, sampling
from polycube.surface import closest
from polycube.surface.fit_target import Target
from polycube.surface.measures import twins
from polycube.types import Spline

LINE = np.arange(5) / 4  # points on an edge; its ends belong to corners, where curves meet
# u and v on the edge from each corner to the next
AROUND = np.array([[LINE, 0 * LINE], [1 + 0 * LINE, LINE], [1 - LINE, 1 + 0 * LINE],
                   [0 * LINE, 1 - LINE]])  # fmt: skip


class CurveMatcher:
    """Points on the edges between sides of two CAD faces, matched with the curves between these.

    Parameters
    ----------
    spline : spline at unit scale
    target : the surface
    cad_face : (S,) number of the CAD face of each side; 0 for any

    Attributes
    ----------
    rows : (M, C) matrix from the control points to the points
    side : (M,) a side of each point
    """

    def __init__(self, spline: Spline, target: Target, cad_face: np.ndarray) -> None:
        curves: dict[tuple[int, int], list[np.ndarray]] = {}
        for crease in target.followed.creases:
            curves.setdefault(crease.faces, []).append(
                np.stack([crease.points[:-1], crease.points[1:]], axis=1)
            )
        first, second = twins(corner_nodes(spline))
        adjacent = np.sort(cad_face[np.stack([first, second], axis=1) // 4], axis=1)
        between = (adjacent[:, 0] > 0) & (adjacent[:, 0] < adjacent[:, 1])
        self._trees, parts = [], []
        for pair in np.unique(adjacent[between], axis=0).tolist():
            if tuple(pair) in curves:
                ends = np.concatenate(curves[tuple(pair)])
                self._trees.append(closest.tree(ends[:, [0, 1, 1]]))
                parts.append(first[(adjacent == pair).all(axis=1)])
        edges = np.concatenate([np.zeros(0, np.int64), *parts])
        self._counts = [len(part) * len(LINE) for part in parts]
        self.side = np.repeat(edges // 4, len(LINE))
        u, v = AROUND[edges % 4].transpose(1, 0, 2).reshape(2, -1)
        self.rows: csr_matrix = sampling(spline, u, v, self.side)[0] @ spline.extraction

    def __call__(self, control: np.ndarray) -> np.ndarray:
        """(M, 3) closest points on the curves for control points (C, 3)."""
        places = np.split(self.rows @ control, np.cumsum(self._counts)[:-1])
        goals = [closest.closest(t, p)[0] for t, p in zip(self._trees, places, strict=False)]
        return np.concatenate([np.zeros((0, 3)), *goals])
