"""Bezier geometry of a spline: points, and det J with a certified lower bound.

det J of a tricubic element is a polynomial of degree 8 in each direction.  Its Bernstein
coefficients bound it from below, the corner ones are values, their mean is the element's volume.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from polycube.spline.bernstein import bernstein, derivative, tensor
from polycube.types import Spline

DEGREE = 8  # of det J
CORNERS = np.array([0, 8, 72, 80, 648, 656, 720, 728])  # of a (9, 9, 9) tensor
LINE = (1 - np.cos(np.pi * np.arange(9) / 8)) / 2  # Chebyshev's extrema: stable to interpolate at
GRID = np.stack(np.meshgrid(LINE, LINE, LINE, indexing="ij"), axis=-1).reshape(-1, 3)[:, ::-1]
MAX_LEVEL = 16  # halvings of a box
MAX_BOXES = 20_000  # held at once; 117 MB
HALVINGS = 3  # for the bounds of all elements
SLACK = 0.01  # of the volume, that such a bound may lie below a value
CHUNK = 64  # elements at a time


@dataclass(frozen=True)
class Jacobian:
    """det J of a whole spline; lengths in the user's units, parameter cube of edge 1."""

    volume: float
    min_detj: float  # smallest value met
    lower_bound: float  # certified to rounding: det J is nowhere smaller
    min_scaled_detj: float  # smallest det J over the volume of its element; 1 in a parallelepiped
    element: int  # that holds min_detj
    position: tuple[float, float, float]  # where


def bezier_points(spline: Spline) -> np.ndarray:
    """(E, 64, 3) Bezier points of each element."""
    return (spline.extraction @ spline.control)[spline.nodes]


def scaled_detj(spline: Spline) -> np.ndarray:
    """(E,) least det J among 9^3 samples of each element over the element's volume."""
    values = _values(bezier_points(spline))
    weights = np.linalg.inv(bernstein(LINE, DEGREE)).mean(
        axis=0
    )  # exact integral by mean coefficient
    return _scaled(values @ tensor(*[weights[None]] * 3)[0], values)


@lru_cache(maxsize=4)
def min_detj(spline: Spline) -> Jacobian:
    """Smallest det J of the spline, where it is, and a bound that no point goes below.

    Samples 9^3 points per element, then halves the boxes whose bound lies below the least value.
    Kept, for plugin and report ask alike.
    """
    coefficients, values = _detj(bezier_points(spline))
    volumes = coefficients.mean(axis=1)
    least = values.min(axis=1)
    element = int(least.argmin())
    best = float(least[element]), element, GRID[values[element].argmin()]
    best, bound = _descend(coefficients, best, tolerance=1e-6 * np.abs(volumes).mean())
    value, element, place = best
    position = tensor(*bernstein(place)[:, None]) @ bezier_points(spline)[element]
    return Jacobian(
        volume=float(volumes.sum()),
        min_detj=value,
        lower_bound=bound,
        min_scaled_detj=float(_scaled(volumes, values).min()),
        element=element,
        position=tuple(position[0].tolist()),
    )


def scaled_bounds(spline: Spline) -> np.ndarray:
    """(E,) numbers that det J over the volume of its element is certified not to go below.

    At most a hundredth below the least value met, or after three halvings of the element.
    """
    points = bezier_points(spline)
    return np.concatenate(
        [_bounds(chunk) for chunk in np.array_split(points, len(points) // CHUNK + 1)]
    )


def _bounds(points: np.ndarray) -> np.ndarray:
    boxes, values = _detj(points)
    volume = np.maximum(np.abs(boxes.mean(axis=1)), np.finfo(float).tiny)
    least, settled = values.min(axis=1), np.full(len(points), np.inf)
    element, origin = np.arange(len(points)), np.zeros((len(points), 3))
    for level in range(HALVINGS + 1):
        np.minimum.at(least, element, boxes[:, CORNERS].min(axis=1))
        bound = boxes.min(axis=1)
        is_open = (bound < least[element] - SLACK * volume[element]) & (level < HALVINGS)
        np.minimum.at(settled, element[~is_open], bound[~is_open])
        if not is_open.any():
            break
        boxes, element, origin = _halve(boxes[is_open], element[is_open], origin[is_open], level)
    return settled / volume


def _scaled(volumes: np.ndarray, values: np.ndarray) -> np.ndarray:
    return values.min(axis=1) / np.maximum(np.abs(volumes), np.finfo(float).tiny)


def _detj(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bernstein coefficients and grid values (E, 729) of det J; points (E, 64, 3)."""
    values = _values(points)
    return _along_axes(values, np.linalg.inv(bernstein(LINE, DEGREE))), values


def _values(points: np.ndarray) -> np.ndarray:
    chunks = np.array_split(points, len(points) // CHUNK + 1)
    return np.concatenate([detj(chunk, LINE) for chunk in chunks])


def detj(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(E, n^3) det J of elements with Bezier points (E, 64, 3) on the grid line x line x line."""
    values, slopes = bernstein(line), derivative(line)
    n = len(line)
    cube = points.transpose(1, 0, 2).reshape(4, -1)  # elements last: no step has to transpose
    z = (np.concatenate([values, slopes]) @ cube).reshape(2, n, 4, -1)
    plain = values @ z.reshape(2, n, 4, -1)  # (2, n, n, 4 * 3 E)
    bent = slopes @ z[0]

    def tangent(table: np.ndarray, lines: np.ndarray) -> np.ndarray:
        """(3, n^3, E) coordinates, from values or slopes along x of lines (n, n, 12 E)."""
        at = table @ lines.reshape(n, n, 4, -1)
        return np.ascontiguousarray(at.reshape(n**3, -1, 3).transpose(2, 0, 1))

    a, b, c = tangent(slopes, plain[0]), tangent(values, bent), tangent(values, plain[1])
    det = a[0] * (b[1] * c[2] - b[2] * c[1])
    det += a[1] * (b[2] * c[0] - b[0] * c[2])
    det += a[2] * (b[0] * c[1] - b[1] * c[0])
    return np.ascontiguousarray(det.T)


def _along_axes(values: np.ndarray, *matrices: np.ndarray) -> np.ndarray:
    """Apply a (9, 9) matrix per axis x, y, z (or one for all) to tensors (n, 729)."""
    x, y, z = matrices * (3 // len(matrices))
    cube = values.reshape(-1, 9, 9, 9)
    return np.einsum("nkji,ck,bj,ai->ncba", cube, z, y, x, optimize=True).reshape(-1, 729)


def _descend(
    boxes: np.ndarray, best: tuple[float, int, np.ndarray], tolerance: float
) -> tuple[tuple[float, int, np.ndarray], float]:
    """Improve the least value (value, element, place) and return the bound, box by box.

    boxes : (n, 729) Bernstein coefficients, at first of whole elements
    """
    element, origin, settled = np.arange(len(boxes)), np.zeros((len(boxes), 3)), np.inf
    for level in range(MAX_LEVEL + 1):
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
    """The eight halves of each box by de Casteljau's rule, with their element and origin."""
    halves = [bernstein(np.array([0.5]), i)[0] for i in range(DEGREE + 1)]
    low = np.array([np.pad(row, (0, DEGREE - i)) for i, row in enumerate(halves)])
    sides = [low, low[::-1, ::-1]]
    octants = list(product((0, 1), repeat=3))
    children = [_along_axes(boxes, *(sides[side] for side in octant)) for octant in octants]
    shift = np.repeat(np.array(octants), len(boxes), axis=0) / 2 ** (level + 1)
    return np.concatenate(children), np.tile(element, 8), np.tile(origin, (8, 1)) + shift
