"""Hex sizes: lengths in settings, boxes with smaller hexes, and the resulting numbers.

The mesh is a lattice of slabs, so a box with smaller hexes refines whole slabs in each of the three
directions. The mesh stays conforming and keeps its quality, but it is refined across the whole
part.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import Annotated

import numpy as np

from polycube.errors import MeshingError
from polycube.types import PerAxis, Polycube, RoughMap
from polycube.types.options import Such, require

logger = logging.getLogger(__name__)

Counts = PerAxis  # parts of each lattice interval, per axis

BYTES = 6_000  # peak memory of meshing per hex before pillowing: 0.39 GiB at 93,000 (dice)
GROWTH = 1.5  # largest ratio of neighbouring slabs beside a box of smaller hexes
ALONG, ACROSS = 32, 16  # samples of a lattice interval, along the divided axis and across it
REGION = {"box", "size", "along"}  # keys
ABOUT = 1.5  # permitted ratio between the hexes of a lattice and the wanted size
PIECES = 256  # pieces of a lattice interval in the distribution of lines


@dataclass(frozen=True, eq=False)
class Box:
    """A region of the model, and the edge length requested there."""

    low: np.ndarray  # (3,)
    high: np.ndarray  # (3,)
    size: float
    along: str = "xyz"  # axes of the polycube whose slabs are refined

    def holds(self, points: np.ndarray) -> np.ndarray:
        """(...) whether points (..., 3) lie inside."""
        return np.all((points >= self.low) & (points <= self.high), axis=-1)


def length(value: object, diagonal: float) -> float:
    """A length in model units: a number, or "5%" of the diagonal; -1 for anything else."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value) if np.isfinite(float(value)) else -1.0
    if isinstance(value, str) and value.strip().endswith("%"):
        try:
            share = float(value.strip()[:-1]) / 100
        except ValueError:
            return -1.0
        return share * diagonal if np.isfinite(share) else -1.0
    return -1.0


LENGTH = Such(
    lambda value: length(value, 1.0) > 0,
    "a positive number (in the model's units) or a share of the bounding-box diagonal such as 5%",
)
Length = Annotated[float | str, LENGTH]  # an option


def doublings(size: float, cell: float) -> int:
    """Number of times that a cell is doubled to give hexes of about a size; at least one."""
    return max(1, int(np.log2(ABOUT * size / cell)))


def box_of(region: object, diagonal: float) -> Box:
    """The box of `{box: [x, y, z, X, Y, Z], size: 1%}`, optionally with `along: xy`.

    Raises ValueError for anything else.
    """
    refused = ValueError(
        "a region is {box: [x, y, z, X, Y, Z], size: 1%} with x < X, y < Y, z < Z, "
        f"perhaps with along: the polycube's axes to refine, such as xy; got {region!r}"
    )
    if not isinstance(region, dict) or not {"box", "size"} <= set(region) <= REGION:
        raise refused
    require("the size of a region", LENGTH, region["size"])
    along = region.get("along", "xyz")
    try:
        corners = np.asarray(region["box"], float).reshape(2, 3)
    except (TypeError, ValueError):
        raise refused from None
    if not (corners[0] < corners[1]).all() or not along or set(str(along)) - set("xyz"):
        raise refused
    return Box(corners[0], corners[1], length(region["size"], diagonal), str(along))


def number_of_hexes(polycube: Polycube, counts: Counts) -> float:
    """Number of hexes of a lattice divided into the given parts, without pillows."""
    return float(np.einsum("xyz,x,y,z->", polycube.occupancy, *(n.astype(float) for n in counts)))


def counts_of(polycube: Polycube, lines: PerAxis) -> Counts:
    """Number of parts of each lattice interval between the lines of each axis."""
    axes = zip(lines, polycube.knots, strict=True)
    x, y, z = (np.diff(np.searchsorted(line, knots - 1e-9)) for line, knots in axes)
    return x, y, z


def size_that_fits(fits: Callable[[float], bool], size: float) -> float | None:
    """A size slightly larger than the smallest one that fits; None if no size fits."""
    low, high = size, size
    while not fits(high):
        low, high = high, 4 * high
        if high > 1e12 * size:
            return None
    while high > 1.01 * low:
        middle = (low * high) ** 0.5
        low, high = (low, middle) if fits(middle) else (middle, high)
    return 1.005 * high


def graded(polycube: Polycube, rough_map: RoughMap, counts: Counts, boxes: list[Box]) -> PerAxis:
    """Polycube coordinates of the mesh lines along each axis, denser in boxes.

    The ratio of neighbouring parts is at most about 1.5, or 2 next to a lattice plane, which always
    is a mesh line.
    """
    along = [[box for box in boxes if axis in box.along] for axis in "xyz"]
    x, y, z = (_graded_axis(polycube, rough_map, counts[a], along[a], a) for a in range(3))
    return x, y, z


def _graded_axis(
    polycube: Polycube, rough_map: RoughMap, number: np.ndarray, boxes: list[Box], axis: int
) -> np.ndarray:
    ends = polycube.knots[axis]
    step = np.repeat(np.diff(ends) / PIECES, PIECES)
    start = np.repeat(ends[:-1], PIECES) + step * np.tile(np.arange(PIECES), len(number))
    wanted = np.repeat(_wanted(polycube, rough_map, boxes, axis), PIECES // ALONG)
    wanted = np.minimum(wanted, np.repeat(np.diff(ends) / number, PIECES))
    wanted = (wanted + (GROWTH - 1) / GROWTH * np.abs(start[:, None] - start)).min(axis=1)
    lines = [ends[:1]]
    for i in range(len(number)):
        here = slice(i * PIECES, (i + 1) * PIECES)
        so_far = np.append(0, np.cumsum(step[here] / wanted[here]))
        parts = max(int(number[i]), int(np.ceil(so_far[-1] - 1e-6)))
        places = np.append(start[here], ends[i + 1])
        lines.append(np.interp(np.linspace(0, so_far[-1], parts + 1)[1:], so_far, places))
        lines[-1][-1] = ends[i + 1]
    return np.concatenate(lines)


def _wanted(polycube: Polycube, rough_map: RoughMap, boxes: list[Box], axis: int) -> np.ndarray:
    """(N,) wanted length of a part in each of the ALONG slabs of every interval.

    The length is in polycube units: the length in the model divided by the stretch of the map, the
    minimum over the points of the slab that are in the solid and in a box; infinite if there are
    none.
    """
    steps = [ALONG if a == axis else ACROSS for a in range(3)]
    knots = [
        (k[:-1, None] + np.diff(k)[:, None] * (np.arange(n) + 0.5) / n).ravel()
        for k, n in zip(polycube.knots, steps, strict=True)
    ]
    solid = polycube.occupancy
    for a in range(3):
        solid = np.repeat(solid, steps[a], axis=a)
    points = np.stack(np.meshgrid(*knots, indexing="ij"), axis=-1)[solid]
    ahead = points.copy()
    nudge = 1e-3 * np.diff(polycube.knots[axis]).min()
    ahead[:, axis] += nudge
    from polycube.structure.rough_map import evaluate

    places = evaluate(rough_map, points)
    stretch = np.linalg.norm(evaluate(rough_map, ahead) - places, axis=1) / nudge
    wanted = np.full(len(points), np.inf)
    for box in boxes:
        inside = box.holds(places)
        wanted[inside] = np.minimum(wanted[inside], box.size / stretch[inside])
    least = np.full(len(knots[axis]), np.inf)
    np.minimum.at(least, np.searchsorted(knots[axis], points[:, axis]), wanted)
    return least


def check_number(
    number: float,
    most: int,
    request: str,
    size: float,
    number_at: Callable[[float], float],
    has_regions: bool,
) -> None:
    """Log the number of hexes of a mesh.

    Raises MeshingError if the number is too large; the message has a size that is possible.

    most : largest number
    request : what the user asked for, such as "size 2"
    size : wanted edge length
    number_at : number of hexes as a function of the size
    """
    if number <= most:
        gigabytes = number * BYTES / 2**30
        logger.info("subdivide: %.0f hexes before pillowing, about %.1f GiB", number, gigabytes)
        return
    fitting = size_that_fits(lambda larger: number_at(larger) <= most, size)
    advice = "even the smallest numbers of parts give too many hexes"
    if fitting is not None:
        advice = f"size {fitting:.3g} is possible" + " without regions" * has_regions
    needs = f"{request} needs {number:.3g} hexes{' with the regions' if has_regions else ''}"
    what = f"stage meshing/subdivide: {needs}, more than max_hexes {most}"
    raise MeshingError(what, remedy=advice)
