"""A background grid: the columns of hexes over the quads of a plane section."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np


class NoBackgroundError(Exception):
    """A part has no background grid of a kind; the message is a clause."""


@dataclass(frozen=True, eq=False)
class Background:
    """The section of a part, its levels, and the map of both to space.

    A part is the union of cells of its section between levels: of a plane section between heights
    (swept), of a section (z, r) between angles (turned), or of a section along a path (bent).

    points : (P, 2) of the section
    lines : (S, 2) indices of points: borders of the faces of the part in the section
    marks : (M, 2) places where a curve of the section ends, although it is smooth there
    levels : (L,) ascending, in the unit of the third coordinate
    place : map of points (N, 3) of section and level to space
    is_cyclic : whether the last level is the first one
    """

    points: np.ndarray
    lines: np.ndarray
    marks: np.ndarray
    levels: np.ndarray
    place: Callable[[np.ndarray], np.ndarray]
    is_cyclic: bool = False

    def with_lines(self, lines: np.ndarray) -> "Background":
        """With further lines (N, 2, 2) in the section."""
        new = len(self.points) + np.arange(2 * len(lines)).reshape(-1, 2)
        points = np.concatenate([self.points, lines.reshape(-1, 2)])
        return replace(self, points=points, lines=np.concatenate([self.lines, new]))


def distinct(values: np.ndarray, near: float) -> np.ndarray:
    """Ascending values (N,); those closer than `near` to the next one are replaced by a mean."""
    values = np.sort(values)
    group = np.append(0, np.cumsum(np.diff(values) > near))
    return np.bincount(group, values) / np.bincount(group)
