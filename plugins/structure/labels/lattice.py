"""Bricks from the coordinates of charts: knots, full bricks, and charts with faces of bricks.

Charts with a common value along an axis have a common knot.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit

from polycube.structure.neighbourhoods import defect
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh

from .charts import Charts
from .order import Pair

OFF = np.array([1.3e-3, 2.1e-3, 1.7e-3])  # offset of the centres of bricks, in bricks
# number of trials: the first ones, and the placed triangles for later ones
LEAST, WORK = 4, 400_000
MOST_DEFECTS = 20  # number of defects above which no knots are tried
SAME = 1e-4  # closer values are one knot from the start


@dataclass(frozen=True, eq=False)
class Bricks:
    """Full bricks between knots that follow a surface."""

    full: np.ndarray  # (X, Y, Z) bool
    knots: list[np.ndarray]
    index: list[np.ndarray]  # for each axis the knot of each group
    lost: int  # number of charts without a face of the bricks
    hidden: int  # number of parts of charts, one for each face of the part, without one
    defect: int  # see `topology.defect`

    @property
    def faults(self) -> tuple[int, int, int]:
        """Sort key; smaller is better."""
        return self.defect, self.lost, self.hidden


def bricks(
    surface: TriMesh,
    charts: Charts,
    fields: list[np.ndarray],
    constants: list[np.ndarray],
    index: list[np.ndarray],
    genus: int,
) -> Bricks | None:
    """Bricks for coordinates of the vertices; None if an axis has only one knot.

    fields : (3, V), constant on groups
    constants : for each axis the value of each group
    index : for each axis the knot of each group
    """
    knots = [np.bincount(k, c) / np.bincount(k) for k, c in zip(index, constants, strict=True)]
    if any(len(k) < 2 or (np.diff(k) <= 1e-9).any() for k in knots):
        return None
    axes = zip(fields, charts.group, constants, index, strict=True)
    placed = np.stack([positions(*axis) for axis in axes], axis=1)
    shape = tuple(len(k) - 1 for k in knots)
    middles = np.argwhere(np.ones(shape, bool)) + 0.5 + OFF
    full = (winding_numbers(TriMesh(placed, surface.faces), middles) > 0.5).reshape(shape)
    if not full.any():
        return None
    covered = _covered(full, charts, placed, surface.faces, index)
    seen = np.bincount(charts.chart_of_part, covered) > 0
    lost, hidden = int((~seen).sum()), int((~covered).sum())
    return Bricks(full, knots, index, lost, hidden, defect(full, genus))


def positions(
    values: np.ndarray, group: np.ndarray, constants: np.ndarray, index: np.ndarray
) -> np.ndarray:
    """(V,) coordinates in knot numbers: integers on groups, monotone between."""
    order = np.argsort(constants, kind="stable")
    inner = np.interp(values, constants[order], np.maximum.accumulate(index[order]).astype(float))
    return np.where(group >= 0, index[np.maximum(group, 0)], inner)


def _covered(
    full: np.ndarray, charts: Charts, placed: np.ndarray, faces: np.ndarray, index: list[np.ndarray]
) -> np.ndarray:
    """The parts of charts that contain the centre of a face of the bricks."""
    covered = np.zeros(len(charts.chart_of_part), bool)
    padded = np.pad(full, 1)
    drawn = zip(charts.chart_label, charts.chart_group, strict=True)
    plane = np.array([index[int(label) // 2][group] for label, group in drawn])
    for label in range(6):
        axis = label // 2
        here = np.moveaxis(padded, axis, 0)
        solid, other = (here[:-1], here[1:]) if label % 2 == 0 else (here[1:], here[:-1])
        at = np.argwhere(solid & ~other)
        at[:, 1:] -= 1
        own_faces = np.flatnonzero(charts.label == label)
        first, second = [a for a in range(3) if a != axis]
        corners = placed[faces[own_faces]][:, :, [first, second]]
        _cover(corners, plane[charts.chart[own_faces]], charts.part[own_faces], at, covered)
    return covered


@njit(cache=True)
def _cover(
    corners: np.ndarray, plane: np.ndarray, owner: np.ndarray, at: np.ndarray, covered: np.ndarray
) -> None:
    """Mark the owners of triangles (N, 3, 2) with the centre of a face (M, 3) in their plane."""
    for n in range(len(corners)):
        if covered[owner[n]]:
            continue
        for m in range(len(at)):
            if at[m, 0] != plane[n]:
                continue
            x, y = at[m, 1] + 0.5013, at[m, 2] + 0.5021
            ax, ay = corners[n, 0, 0] - x, corners[n, 0, 1] - y
            bx, by = corners[n, 1, 0] - x, corners[n, 1, 1] - y
            cx, cy = corners[n, 2, 0] - x, corners[n, 2, 1] - y
            a, b, c = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
            if (a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0):
                covered[owner[n]] = True
                break


def quantized(
    surface: TriMesh,
    charts: Charts,
    fields: list[np.ndarray],
    constants: list[np.ndarray],
    pairs: list[Pair],
    apart: float,
    genus: int,
) -> Bricks | None:
    """Bricks with few knots: neighbours closer than `apart` are merged if nothing is lost.

    Pairs of groups that face each other have two different knots. The number of trials is limited
    by the number of triangles.
    """
    separate = {(pair.axis, pair.low, pair.high) for pair in pairs}
    index = []
    for values in constants:  # ranks, equal for close values
        order = np.argsort(values, kind="stable")
        index.append(np.zeros(len(values), int))
        index[-1][order] = np.cumsum(np.append(0, np.diff(values[order]) > SAME))
    best = bricks(surface, charts, fields, constants, index, genus)
    if best is None or best.defect > MOST_DEFECTS:
        return best
    for near in apart / 2.0 ** np.arange(3):
        index = [_clusters(constants[axis], axis, near, separate) for axis in range(3)]
        found = bricks(surface, charts, fields, constants, index, genus)
        if found is not None and found.faults <= best.faults:
            best = found
            break
    tried: set[tuple[int, bytes]] = set()
    for _ in range(LEAST + WORK // len(surface.faces)):
        trial = next(_merges(best, apart, separate, tried), None)
        if trial is None:
            break
        found = bricks(surface, charts, fields, constants, trial, genus)
        if found is not None and found.faults <= best.faults:
            best = found
    return best


def _merges(
    best: Bricks, apart: float, separate: set[tuple[int, int, int]], tried: set[tuple[int, bytes]]
) -> Iterator[list[np.ndarray]]:
    """Knots of the groups after merging two neighbours, the closest first, without repetitions."""
    gaps = [np.diff(knots) for knots in best.knots]
    near = ((float(gap), a, k) for a in range(3) for k, gap in enumerate(gaps[a]) if gap < apart)
    for _, axis, k in sorted(near):
        new = np.where(best.index[axis] > k, best.index[axis] - 1, best.index[axis])
        is_broken = any(a == axis and new[low] == new[high] for a, low, high in separate)
        if is_broken or (axis, new.tobytes()) in tried:
            continue
        tried.add((axis, new.tobytes()))
        yield [new if a == axis else best.index[a] for a in range(3)]


def _clusters(
    values: np.ndarray, axis: int, near: float, separate: set[tuple[int, int, int]]
) -> np.ndarray:
    """Knot number of each value: neighbours within `near` are merged unless they are a pair."""
    index, knot = np.zeros(len(values), int), 0
    members: list[int] = []
    for group in np.argsort(values, kind="stable").tolist():
        is_near = all(abs(values[group] - values[other]) < near for other in members[:1])
        if not is_near or any((axis, other, group) in separate for other in members):
            members, knot = [], knot + 1
        members.append(group)
        index[group] = knot
    return index
