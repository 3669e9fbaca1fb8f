"""The features of a surface: its curves and the points where they end.

Of a CAD model they are the curves between two of its faces, tangent ones too; of triangles alone
the edges at which the surface turns (`polycube.surface.creases` finds both).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.surface import arc_length as sliding


@dataclass(frozen=True, eq=False)
class Crease:
    """A curve of a surface, as a chain of edges; a loop ends at its first point again."""

    points: np.ndarray  # (N, 3)
    arc: np.ndarray  # (N,) length up to each point
    inside: np.ndarray  # (N - 1,) angle of the solid at each edge, below pi where convex
    ends: tuple[int, int]  # corners; (-1, -1) for a loop
    faces: tuple[int, int] = (0, 0)  # CAD faces beside it, ascending; equal inside a face

    @property
    def length(self) -> float:
        """Of the whole crease."""
        return float(self.arc[-1])

    @property
    def is_loop(self) -> bool:
        """Whether it has no ends."""
        return self.ends[0] < 0

    def at(self, arc: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (N, 3), unit directions (N, 3) and inside angles (N,) at arc lengths (N,)."""
        arc = np.mod(arc, self.length) if self.is_loop else np.clip(arc, 0, self.length)
        edge = np.clip(np.searchsorted(self.arc, arc, side="right") - 1, 0, len(self.inside) - 1)
        step = np.diff(self.points, axis=0)[edge]
        length = np.diff(self.arc)[edge]
        share = ((arc - self.arc[edge]) / length)[:, None]
        return self.points[edge] + share * step, step / length[:, None], self.inside[edge]

    def nearest(
        self, points: np.ndarray, expected: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Arc lengths (N,) of the closest points, and distances (N,).

        expected : (N,) arc lengths that tell branches apart where the crease comes near itself; a
            loop's may be beyond its length, and the answers are then too.  On a branch the closest
            point counts alone: a point on the crease is its own answer
        """
        if expected is None:
            expected = np.full(len(points), np.nan)
        arc, square = sliding.nearest(self.points, self.arc, self.is_loop, points, expected)
        return arc, np.sqrt(square)


@dataclass(frozen=True, eq=False)
class Features:
    """Curves of a surface and their end points.

    Parameters
    ----------
    creases : the curves
    corners : (C, 3) the points where they end
    is_fixed : (C,) whether more than the loose end of one curve
    noise : (N, 2) ends of the edges that are sharp seen from near only
    n_faces : CAD faces; 0 for a surface of triangles alone
    """

    creases: tuple[Crease, ...]
    corners: np.ndarray
    is_fixed: np.ndarray
    noise: np.ndarray
    n_faces: int = 0
