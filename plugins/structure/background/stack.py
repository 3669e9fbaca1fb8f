"""The axis along which a part is a stack of slabs, and the lines of its section."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from polycube.hexmesh.background.background import Background, NoBackgroundError, distinct
from polycube.surface.measures import curved_faces, diagonal, frame, half_edges, place, twins
from polycube.types import TriMesh

from .rings import Pairs
from .upright import Upright, leaning_share, upright
from .walls import FLAT, Triangles, caps, check_walls, triangles, wall_of

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

NEAR = 1e-5  # of the diagonal: tolerance for equal points and heights
STEPS = 500  # steps of a coordinate of unit normals that distinguish planes
CLOSE = 0.2  # smallest ratio of the parts into which a level divides a slab
# of the distance of a level from the others that divide the same face: a closer one replaces it
REACH = 0.3
OBLIQUE = 5e-3  # tangent: tolerance for curves on walls along the axis or across it
PLANE = 0.01  # share of the area that a nearly plane face may lose in its mean direction
MOST = 0.5  # largest share of the area that leans, if it leans less for another axis
AXES = 6  # number of directions tried, those of the largest planes


def stack(
    surface: TriMesh, sizes: Sizes, axis: np.ndarray | None = None, may_slope: bool = True
) -> tuple[Background, Upright | None]:
    """The stack of slabs with the smallest changes and the fewest levels; its surface if changed.

    Its faces are perpendicular to an axis (caps) and along it (walls). Lines are borders of caps,
    levels are the heights of caps and of curves on walls, and marks are curves between two walls.
    If CAD faces lean for every axis, they are set upright or flat in the surface, and round holes
    across the axis are made square, unless most of the area leans. Parts of planes only are not
    changed, because polycubes of such parts have fewer hexes.

    Raises NoBackgroundError if for no axis all faces are along it or perpendicular to it, or can be
    set so; with the reason for the first axis.

    axis : (3,) the axis, if it is given
    may_slope : as in `upright`; the sides of an unfolded sheet do not
    """
    near = NEAR * diagonal(surface)
    known = triangles(surface, near)
    pairs, axes = twins(surface.faces), list(_axes(known)) if axis is None else [axis]
    has_round_face = len(surface.region) and curved_faces(surface, PLANE).any()
    reasons = []
    for may_lean in (False, True)[: 1 + has_round_face]:
        found = []
        if may_lean:
            axes = [axis for axis in axes if leaning_share(surface, axis) < MOST] or axes[:1]
        for axis in axes:
            try:
                part = upright(surface, pairs, axis, near, sizes, may_slope) if may_lean else None
                found.append((_stack(surface, known, pairs, axis, part), part))
            except NoBackgroundError as reason:
                reasons.append(reason)
        if found:
            return min(found, key=lambda each: (_shift(surface, each[1]), len(each[0].levels)))
    raise reasons[-len(axes)]


def _shift(surface: TriMesh, part: Upright | None) -> float:
    """Largest distance by which a vertex is moved, rounded to a thousandth of the diagonal."""
    if part is None:
        return 0.0
    shift = np.linalg.norm(part.surface.vertices - surface.vertices, axis=1).max()
    return round(float(shift / diagonal(surface)), 3)


def _axes(known: Triangles) -> Iterator[np.ndarray]:
    """(3,) unit normals of the largest planes, the largest first; one of opposite ones."""
    key = np.round(known.normals * STEPS).astype(np.int64) @ [4 * STEPS**2, 2 * STEPS, 1]
    sign = np.where(key < 0, -1, 1)
    names, of = np.unique(abs(key), return_inverse=True)
    sums = np.stack(
        [np.bincount(of, c * sign, len(names)) for c in (known.area[:, None] * known.normals).T],
        axis=1,
    )
    size = np.linalg.norm(sums, axis=1)
    for number in np.argsort(-size, kind="stable")[:AXES]:
        yield sums[number] / size[number]


def _stack(
    surface: TriMesh, known: Triangles, pairs: Pairs, axis: np.ndarray, part: Upright | None
) -> Background:
    """The part along an axis; raises NoBackgroundError if it is not a stack."""
    near, rows = NEAR * diagonal(surface), frame(axis)
    is_over = np.zeros(surface.faces.shape, bool)  # whether a corner was set over another line
    if part is None:
        is_cap, leans = caps(surface, known, axis, near)
    else:
        shift = (part.surface.vertices - surface.vertices) @ rows[:2].T
        is_over = (np.linalg.norm(shift, axis=1) > near)[surface.faces] & part.is_over[:, None]
        surface, is_cap = part.surface, part.is_cap
        known = triangles(surface, near)
        leans = ~(is_cap | part.is_changed | known.is_sliver) & (abs(known.normals @ axis) > FLAT)
    across, height = surface.vertices @ rows[:2].T, surface.vertices @ axis
    sides, others = pairs
    adjacent = np.stack([sides // 3, others // 3], axis=1)
    ends = half_edges(surface.faces)[sides]
    wall = wall_of(surface, known, is_cap, adjacent)
    on_cap = is_cap[adjacent].any(axis=1)
    border = wall[adjacent[:, 0]] != wall[adjacent[:, 1]]
    rise = abs(np.diff(height[ends], axis=1)[:, 0])
    run = np.linalg.norm(np.diff(across[ends], axis=1)[:, 0], axis=1)
    askew = border & ~on_cap & (np.minimum(rise, run) > np.maximum(near, OBLIQUE * (rise + run)))
    if askew.any():
        where = surface.vertices[ends[np.argmax(askew)]].mean(axis=0)
        raise NoBackgroundError(f"a curve is oblique on the walls near {place(surface, where)}")
    flat, upright = border & (on_cap | (rise < run)), border & ~on_cap & (rise >= run)
    check_walls(surface, known, across, wall, leans, (adjacent[flat], ends[flat]), near)
    both_over = np.all(half_edges(is_over), axis=1)
    own = flat & ~both_over[sides] & ~both_over[others]
    used, lines = np.unique(ends[own], return_inverse=True)
    tops = np.concatenate([surface.faces[is_cap].ravel(), ends[flat & ~on_cap].ravel()])
    levels = distinct(height[tops], 10 * near)
    if part is not None:
        levels = _with_further(levels, part.levels)
    marks = across[ends[upright]].mean(axis=1)
    return Background(across[used], lines.reshape(-1, 2), marks, levels, lambda at: at @ rows)


def _with_further(levels: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    """Ascending levels with those of groups that are not close to others, the farthest first.

    groups : levels (N,) that divide each face, at similar distances
    """
    left = [
        (height, REACH * min(abs(height - other) for other in (*levels, *group) if other != height))
        for group in groups
        for height in group[(group > levels[0]) & (group < levels[-1])]
    ]
    while left:
        height, reach = max(left, key=lambda each: abs(each[0] - levels).min())
        left.remove((height, reach))
        k = np.searchsorted(levels, height)
        gaps = height - levels[k - 1], levels[k] - height
        if min(gaps) > max(CLOSE * max(gaps), reach):
            levels = np.insert(levels, k, height)
    return levels
