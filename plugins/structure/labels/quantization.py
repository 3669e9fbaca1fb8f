"""Charts with a common knot: values along the axes become knot numbers."""

from collections.abc import Iterator

import numpy as np

from polycube.types import TriMesh

from .charts import Charts
from .lattice import Bricks, bricks
from .order import Pair

# number of trials: the first ones, and the placed triangles for later ones
LEAST, WORK = 4, 400_000
MOST_DEFECTS = 20  # number of defects above which no knots are tried
SAME = 1e-4  # closer values are one knot from the start


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
    index = [_ranks(values, SAME) for values in constants]
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
    gaps = sorted(
        (float(gap), axis, k)
        for axis in range(3)
        for k, gap in enumerate(np.diff(best.knots[axis]))
        if gap < apart
    )
    for _, axis, k in gaps:
        new = np.where(best.index[axis] > k, best.index[axis] - 1, best.index[axis])
        if (axis, new.tobytes()) in tried or _breaks(new, axis, separate):
            continue
        tried.add((axis, new.tobytes()))
        yield [new if a == axis else best.index[a] for a in range(3)]


def _ranks(values: np.ndarray, near: float) -> np.ndarray:
    """Rank of each value; values closer than `near` to the next one have the same rank."""
    order = np.argsort(values, kind="stable")
    rank = np.zeros(len(values), int)
    rank[order] = np.cumsum(np.append(0, np.diff(values[order]) > near))
    return rank


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


def _breaks(index: np.ndarray, axis: int, separate: set[tuple[int, int, int]]) -> bool:
    """Whether two groups of a pair would have one knot."""
    return any(a == axis and index[low] == index[high] for a, low, high in separate)
