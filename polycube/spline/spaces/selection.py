"""Elements to refine: the options of `refine`, common to the spline plugins.

Elements are selected by a list or file, by boxes, where the surface turns, or where the spline
deviates from the part. The last three are extended by rings of neighbours: a function of the finer
level needs four of its elements in each direction, so a single refined element has none.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from polycube.errors import InputError
from polycube.types import TriMesh
from polycube.types.checks import is_number, is_whole
from polycube.types.options import Count, Options, Share, limits

if TYPE_CHECKING:
    from polycube.spline.spaces.hierarchy import Level, Space

logger = logging.getLogger(__name__)

LINE = (np.arange(4) + 0.5) / 4  # samples of a face in each direction
NOTHING = 1e-10  # root mean square distance, in diagonals, below which it is a rounding error


@dataclass(frozen=True)
class Refinement(Options):
    """Elements to refine, with the numbers after `levels`; default: none.

    Parameters
    ----------
    levels : number of times that every element is split into eight, before anything else
    elements : elements to refine: their numbers, or a file with lines "level element"
    boxes : regions to refine, such as [{box: [0, 0, 0, 1, 1, 2], level: 2}], low corner first, in
        the units of the part
    curvature : angle in degrees; elements with an outer face that turns by more are refined; 0:
        none
    indicator : share of the squared distance to the surface whose elements are refined; 0: none
    depth : largest number of levels that curvature and indicator add
    rings : rings of neighbours that are refined with the elements marked by boxes, curvature or
        indicator
    """

    group = "refine."
    levels: Annotated[int, limits(0)] = 0
    elements: str | Sequence[int] = field(default_factory=list)
    boxes: Sequence[Mapping] = field(default_factory=list)
    curvature: Annotated[float, limits(0, 180)] = 0
    indicator: Share = 0
    depth: Count = 1
    rings: Annotated[int, limits(0)] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        for box in self.boxes:
            _check_box(box)
        self.listed()

    def listed(self) -> list[np.ndarray]:
        """[l] elements of each level in their order; those of level l > 0 are numbers of children.

        Child c, in the order of corners of VTK, of the i-th element listed one level before is 8 i
        + c.
        """
        if not isinstance(self.elements, str):
            if not all(is_whole(element, 0) for element in self.elements):
                what = "refine.elements must be whole numbers >= 0 or a file"
                raise ValueError(f"{what}; got {self.elements!r}")
            levels = [list(self.elements)] if len(self.elements) else []
        else:
            levels = _from_file(Path(self.elements))
        for level, elements in enumerate(levels):
            if len(set(elements)) < len(elements):
                raise ValueError(f"refine.elements contains an element of level {level} twice")
        return [np.array(elements, np.int64) for elements in levels]

    def marked(self, level: Level, depth: int, surface: TriMesh) -> np.ndarray:
        """Elements (M,) of Omega marked by boxes, curvature and indicator, with their rings."""
        from polycube.spline.spaces.hierarchy import ring

        marks = np.zeros(len(level.inside), bool)
        for box in self.boxes:
            if box.get("level", 1) > depth:
                places = (level.space.extraction @ level.space.control)[level.space.nodes]
                low, high = np.reshape(np.array(box["box"], float), (2, 3))
                met = ((places.min(axis=1) < high) & (places.max(axis=1) > low)).all(axis=1)
                marks |= met
                if depth == 0 and not met.any():
                    logger.warning("warning: refine.boxes: no element meets %s", list(box["box"]))
        if depth < self.depth and self.curvature:
            marks[_bent(level.space, np.radians(self.curvature))] = True
        if depth < self.depth and self.indicator:
            marks[_missing(level, surface, self.indicator)] = True
        for _ in range(self.rings):
            marks[ring(level.space, np.flatnonzero(marks & level.inside))] = True
        return np.flatnonzero(marks & level.inside)


def _check_box(box: Mapping) -> None:
    """Raise ValueError unless it is {box: [x, y, z, X, Y, Z], level: 1}."""
    wanted = f"a box of refine.boxes must be {{box: [x, y, z, X, Y, Z], level: 1}}; got {box!r}"
    if not isinstance(box, Mapping) or "box" not in box or set(box) - {"box", "level"}:
        raise ValueError(wanted)
    corners, level = box["box"], box.get("level", 1)
    if not isinstance(corners, Sequence) or len(corners) != 6:
        raise ValueError(wanted)
    if not all(map(is_number, corners)) or not is_whole(level, 1):
        raise ValueError(wanted)
    if not all(low < high for low, high in zip(corners[:3], corners[3:], strict=True)):
        raise ValueError(f"a box of refine.boxes must have its low corner first; got {box!r}")


def _from_file(path: Path) -> list[list[int]]:
    """[l] elements, from lines "level element"."""
    if not path.is_file():
        raise ValueError(f"refine.elements: there is no file {str(path)!r}")
    pairs = []
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        fields = line.split()
        if fields and not (len(fields) == 2 and all(text.isdecimal() for text in fields)):
            raise ValueError(f'{path}, line {number}: needs "level element"; got {line!r}')
        pairs += [tuple(map(int, fields))] if fields else []
    deepest = max((level for level, _ in pairs), default=-1)
    if deepest > 20:
        raise ValueError(f"{path}: level {deepest} is larger than 20")
    return [[e for level, e in pairs if level == wanted] for wanted in range(deepest + 1)]


def check_listed(listed: Sequence[np.ndarray], n_elements: int) -> None:
    """Raise InputError for an element that a mesh of n_elements does not have."""
    for level, elements in enumerate(listed):
        limit = 8 * len(listed[level - 1]) if level else n_elements
        if elements.max(initial=-1) >= limit:
            what = f"refine.elements contains element {elements.max()} of level {level}"
            many = f"those listed before have {limit} children"
            raise InputError(f"{what}, where {many if level else f'there are {limit} elements'}")


def _bent(space: Space, angle: float) -> np.ndarray:
    """Elements with an outer face whose normals turn by more than `angle` radians."""
    from polycube.spline.boundary import grid, normals, sampling

    u, v = grid(np.linspace(0, 1, 3))
    points = space.extraction @ space.control
    _, du, dv = sampling(space, u, v)
    normal = normals(du @ points, dv @ points).reshape(-1, 9, 3)
    cosine = np.einsum("qac,qbc->qab", normal, normal).min(axis=(1, 2))
    return space.sides[cosine < np.cos(angle), 0]


def _missing(level: Level, surface: TriMesh, share: float) -> np.ndarray:
    """The fewest elements of Omega with a share of the squared distance from outer faces.

    The squared distance is integrated over the faces; the marking is that of Doerfler (1996).
    """
    from polycube.spline.boundary import grid, sampling
    from polycube.surface import closest
    from polycube.surface.fit_target import target

    space, goal = level.space, target(surface)
    points = goal.to_unit(space.extraction @ space.control)
    at, du, dv = sampling(space, *grid(LINE))
    area = np.linalg.norm(np.cross(du @ points, dv @ points), axis=1)
    apart = closest.distance(goal.tree, at @ points)
    of_face = (apart**2 * area).reshape(len(space.sides), -1).mean(axis=1)
    error = np.bincount(space.sides[:, 0], of_face, len(space.nodes)) * level.inside
    order = np.argsort(-error, kind="stable")
    total = np.cumsum(error[order])
    if total[-1] <= NOTHING**2 * area.reshape(len(space.sides), -1).mean(axis=1).sum():
        return order[:0]
    return order[: np.searchsorted(total, share * total[-1] * (1 - 1e-12)) + 1]
