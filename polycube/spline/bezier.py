"""Bezier geometry of a spline: points, and det J with a certified lower bound.

det J of a tricubic element is a polynomial of degree 8 in each direction. Its Bernstein
coefficients are bounds from below, those at the corners are values, and their mean is the volume of
the element.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from polycube.hexmesh.certificate import along_axes, halves
from polycube.spline.bernstein import bernstein, tensor
from polycube.spline.det_kernels import detj, least_detj
from polycube.types import Spline

DEGREE = 8  # of det J
OCTANTS, CORNERS = halves(DEGREE)
# extrema of Chebyshev polynomials: stable interpolation points
LINE = (1 - np.cos(np.pi * np.arange(9) / 8)) / 2
TO_BERNSTEIN = np.linalg.inv(bernstein(LINE, DEGREE))  # from values at these points
WEIGHTS = TO_BERNSTEIN.mean(axis=0)  # exact integral, because it is the mean of the coefficients
GRID = np.stack(np.meshgrid(LINE, LINE, LINE, indexing="ij"), axis=-1).reshape(-1, 3)[:, ::-1]
MAX_LEVEL = 16  # largest number of times that a box is halved
MAX_BOXES = 20_000  # boxes at once; 117 MB
HALVINGS = 3  # number of times that elements are halved for their bounds
SLACK = 0.01  # of the volume: permitted difference between such a bound and a value
CHUNK = 64  # elements in a batch whose coefficients are stored


@dataclass(frozen=True)
class Jacobian:
    """det J of a whole spline in cubed model units, for parameters from 0 to 1."""

    volume: float
    min_detj: float  # smallest value found
    lower_bound: float  # certified up to rounding errors: det J is nowhere smaller
    # smallest det J divided by the volume of its element; 1 for a parallelepiped
    min_scaled_detj: float
    element: int  # element with min_detj
    position: tuple[float, float, float]  # its place
    scaled_element: int  # element with min_scaled_detj
    scaled_position: tuple[float, float, float]  # its place


def bezier_points(spline: Spline) -> np.ndarray:
    """(E, 64, 3) Bezier points of each element."""
    return (spline.extraction @ spline.control)[spline.nodes]


def scaled_detj(spline: Spline, elements: np.ndarray | slice = slice(None)) -> np.ndarray:
    """(E,) smallest det J of 9^3 samples of each element, or of some, divided by its volume."""
    points = spline.extraction @ spline.control
    return _scaled(*least_detj(points, spline.nodes[elements], LINE, WEIGHTS))


@lru_cache(maxsize=4)
def min_detj(spline: Spline) -> Jacobian:
    """Smallest det J of the spline, its place, and a lower bound for all points.

    9^3 points per element are sampled; then boxes whose bound is below the smallest value are
    halved. The result is cached for the plugin and the report.
    """
    points, nodes = spline.extraction @ spline.control, spline.nodes
    least, volumes = least_detj(points, nodes, LINE, WEIGHTS)
    scaled = _scaled(least, volumes)
    element, lowest = int(least.argmin()), int(scaled.argmin())
    values, others = detj(points, nodes[[element, lowest]], LINE)
    best = float(values.min()), element, GRID[values.argmin()]
    tolerance = 1e-6 * np.abs(volumes).mean()
    best, bound = _descend(*_open(points, nodes, best[0] - tolerance), best, tolerance)
    value, element, place = best
    position = tensor(*bernstein(place)[:, None]) @ points[nodes[element]]
    there = tensor(*bernstein(GRID[others.argmin()])[:, None]) @ points[nodes[lowest]]
    return Jacobian(
        volume=float(volumes.sum()),
        min_detj=value,
        lower_bound=min(bound, value),  # up to rounding errors
        min_scaled_detj=float(scaled[lowest]),
        element=element,
        position=tuple(position[0].tolist()),
        scaled_element=lowest,
        scaled_position=tuple(there[0].tolist()),
    )


def scaled_bounds(spline: Spline) -> np.ndarray:
    """(E,) certified lower bounds of det J divided by the volume of its element.

    They are at most a hundredth below the smallest value found, or result from three halvings.
    """
    points, nodes = spline.extraction @ spline.control, spline.nodes
    chunks = np.array_split(nodes, len(nodes) // CHUNK + 1)
    return np.concatenate([_bounds(points, chunk) for chunk in chunks])


def _bounds(points: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    values = detj(points, nodes, LINE)
    boxes = along_axes(values, (TO_BERNSTEIN,) * 3)
    volume = np.maximum(np.abs(boxes.mean(axis=1)), np.finfo(float).tiny)
    least, settled = values.min(axis=1), np.full(len(nodes), np.inf)
    element, origin = np.arange(len(nodes)), np.zeros((len(nodes), 3))
    for level in range(HALVINGS + 1):
        np.minimum.at(least, element, boxes[:, CORNERS].min(axis=1))
        bound = boxes.min(axis=1)
        is_open = (bound < least[element] - SLACK * volume[element]) & (level < HALVINGS)
        np.minimum.at(settled, element[~is_open], bound[~is_open])
        if not is_open.any():
            break
        boxes, element, origin = _halve(boxes[is_open], element[is_open], origin[is_open], level)
    return settled / volume


def _scaled(least: np.ndarray, volumes: np.ndarray) -> np.ndarray:
    return least / np.maximum(np.abs(volumes), np.finfo(float).tiny)


def _open(
    points: np.ndarray, nodes: np.ndarray, limit: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Bernstein coefficients of the elements that need halving.

    Returns coefficients (n, 729) and numbers (n,) of the elements with coefficients below a limit,
    and the smallest coefficient of all other elements.
    """
    boxes, elements, settled = [], [], np.inf
    for part in np.array_split(np.arange(len(nodes)), len(nodes) // CHUNK + 1):
        coefficients = along_axes(detj(points, nodes[part], LINE), (TO_BERNSTEIN,) * 3)
        bound = coefficients.min(axis=1)
        settled = min(settled, bound[bound >= limit].min(initial=np.inf))
        boxes.append(coefficients[bound < limit])
        elements.append(part[bound < limit])
    return np.concatenate(boxes), np.concatenate(elements), settled


def _descend(
    boxes: np.ndarray,
    element: np.ndarray,
    settled: float,
    best: tuple[float, int, np.ndarray],
    tolerance: float,
) -> tuple[tuple[float, int, np.ndarray], float]:
    """Improve the smallest value (value, element, place) and return the bound, box by box.

    boxes : (n, 729) Bernstein coefficients, at first of whole elements (n,)
    settled : smallest coefficient of all other elements
    """
    origin = np.zeros((len(boxes), 3))
    for level in range(MAX_LEVEL + 1):
        if len(boxes) == 0:
            return best, float(settled)
        corners = boxes[:, CORNERS]
        box, corner = np.unravel_index(corners.argmin(), corners.shape)
        if corners[box, corner] < best[0]:
            place = origin[box] + GRID[CORNERS[corner]] / 2**level
            best = float(corners[box, corner]), int(element[box]), place
        bound = boxes.min(axis=1)
        is_open = bound < best[0] - tolerance
        settled = min(settled, bound[~is_open].min(initial=np.inf))
        if not 0 < is_open.sum() <= MAX_BOXES // 8 or level == MAX_LEVEL:
            return best, float(min(settled, bound.min()))
        boxes, element, origin = _halve(boxes[is_open], element[is_open], origin[is_open], level)
    raise AssertionError("the last level returns")


def _halve(
    boxes: np.ndarray, element: np.ndarray, origin: np.ndarray, level: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The eight halves of each box by de Casteljau's algorithm, with their element and origin."""
    children = [along_axes(boxes, each) for each in OCTANTS]
    lower = np.array(list(product((0, 1), repeat=3)))[:, ::-1]  # the order of OCTANTS: z slowest
    shift = np.repeat(lower, len(boxes), axis=0) / 2 ** (level + 1)
    return np.concatenate(children), np.tile(element, 8), np.tile(origin, (8, 1)) + shift
