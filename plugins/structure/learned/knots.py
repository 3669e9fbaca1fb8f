"""From a draw of the network to a lattice: charts of equal labels, their knots, full bricks.

A chart is a connected part of the surface with one label. On the polycube it lies in a plane, whose
position is the mean of the drawn positions of its points, so that errors of single points cancel.
Charts along an axis that are close to each other have a common knot, and a brick is full if the
surface, with its vertices at the drawn positions, winds around it. A few tolerances for close
charts are tried until the bricks are one solid with the genus of the part. Isolated wrong labels
make small charts, which are ignored; there is no result if the labels do not correspond to a
polycube.

Charts can be flattened first, which straightens bent parts: charts and vertices are then placed
such that the gradients of the coordinates are as close as possible to those of the drawn positions,
with one value for each chart.
"""

from typing import NamedTuple

import numpy as np

from polycube.structure.lattice import collapse
from polycube.structure.neighbourhoods import defect
from polycube.surface.measures import connected, face_areas, twins
from polycube.surface.voxels import winding_numbers
from polycube.types import Polycube, TriMesh

from ..labels.charts import field, stiffness
from ..labels.lattices import OnBricks
from .draws import Draw

NEAR = (0.035, 0.025, 0.05, 0.015)  # tolerances for charts with a common knot, in diagonals
LIGHT = 0.001  # share of the area below which charts are ignored
OFF = np.array([1.3e-5, 2.1e-5, 1.7e-5])  # offset of the centres of bricks
MOST_FULL = 0.5  # winding number above which a brick is full


class Charts(NamedTuple):
    """Charts of a surface, without small ones, and their drawn positions."""

    chart: np.ndarray  # (F,) of each triangle; -1 if it is ignored
    axis: np.ndarray  # (C,) 0..2
    value: np.ndarray  # (C,) along its axis
    area: np.ndarray  # (C,) share of the surface


class Lattice(NamedTuple):
    """The lattice of a draw."""

    polycube: Polycube  # collapsed, in the frame
    charts: Charts
    places: np.ndarray  # (V, 3) drawn positions of the vertices
    near: float  # tolerance for charts with a common knot


def lattice(surface: TriMesh, draw: Draw, genus: int, flat: bool = False) -> Lattice | None:
    """The lattice of a draw for a fine surface; None if no tolerance gives the genus of the part.

    flat : whether charts are flattened first
    """
    places = draw.places
    own = charts(surface, draw.log_axis.argmax(axis=1), places)
    if np.bincount(own.axis, minlength=3).min() < 2:
        return None
    if flat:
        own, places = flattened(surface, own, places)
    for near in NEAR:
        along = [own.axis == axis for axis in range(3)]
        knots = [clusters(own.value[on], own.area[on], near) for on in along]
        if min(map(len, knots)) < 2:
            continue
        full = filled(TriMesh(places, surface.faces), knots)
        if full.any() and defect(full, genus) == 0:
            x, y, z = knots
            polycube = collapse(Polycube(full, x, y, z, (1, 1, 1), ("lattice",)))
            return Lattice(polycube, own, places, near)
    return None


def charts(surface: TriMesh, label: np.ndarray, places: np.ndarray) -> Charts:
    """Charts of labels (F,) with the positions (V, 3) of the vertices."""
    first, second = twins(surface.faces)
    same = label[first // 3] == label[second // 3]
    chart = connected(first[same] // 3, second[same] // 3, len(label))
    area = face_areas(surface) / face_areas(surface).sum()
    middle = places[surface.faces].mean(axis=1)
    total = np.bincount(chart, area)
    moment = np.bincount(chart, area * middle[np.arange(len(label)), label // 2])
    axis = np.zeros(len(total), int)
    axis[chart] = label // 2
    heavy = total > LIGHT
    number = np.where(heavy, np.cumsum(heavy) - 1, -1)
    return Charts(number[chart], axis[heavy], moment[heavy] / total[heavy], total[heavy])


def flattened(surface: TriMesh, charts: Charts, places: np.ndarray) -> tuple[Charts, np.ndarray]:
    """Charts and positions (V, 3) with one value on its axis for each chart."""
    matrix, flat, value = stiffness(surface), np.empty_like(places), charts.value.copy()
    for axis in range(3):
        numbers, group = np.unique(_on(surface, charts, charts.axis == axis), return_inverse=True)
        group = group.ravel() - (numbers[0] < 0)
        numbers = numbers[numbers >= 0]
        coordinate = field(matrix, places[:, axis], group, len(numbers))
        value[numbers] = coordinate.constants
        flat[:, axis] = coordinate.values(value[numbers])
    return charts._replace(value=value), flat


def _on(surface: TriMesh, charts: Charts, chosen: np.ndarray) -> np.ndarray:
    """(V,) the chart, among the chosen ones (C,), of each vertex, or -1."""
    own = np.full(len(surface.vertices), -1)
    is_chosen = (charts.chart >= 0) & chosen[charts.chart]
    own[surface.faces[is_chosen]] = charts.chart[is_chosen, None]
    return own


def clusters(values: np.ndarray, weights: np.ndarray, near: float) -> np.ndarray:
    """Weighted means of values: the closest two are merged until all distances exceed `near`."""
    order = np.argsort(values, kind="stable")
    mean, weight = list(values[order]), list(weights[order])
    while len(mean) > 1 and (gap := np.diff(mean)).min() < near:
        k = int(gap.argmin())
        total = weight[k] + weight[k + 1]
        mean[k] = (mean[k] * weight[k] + mean.pop(k + 1) * weight.pop(k + 1)) / total
        weight[k] = total
    return np.array(mean)


def filled(surface: TriMesh, knots: list[np.ndarray]) -> np.ndarray:
    """(X, Y, Z) bool: bricks between knots inside a surface, by winding numbers."""
    middles = [(line[1:] + line[:-1]) / 2 for line in knots]
    points = np.stack(np.meshgrid(*middles, indexing="ij"), axis=-1)
    winding = winding_numbers(surface, points.reshape(-1, 3) + OFF)
    return (winding > MOST_FULL).reshape(points.shape[:3])


def on_bricks(surface: TriMesh, drawn: Lattice) -> OnBricks:
    """The surface on the lattice, with charts at their knots.

    Between charts, the gradient of the coordinates is as close as possible to that of the
    positions.
    """
    _, charts, places, near = drawn
    matrix, found = stiffness(surface), np.empty_like(places)
    for axis, line in enumerate(drawn.polycube.knots):
        index = np.abs(charts.value[:, None] - line).argmin(axis=1)
        on = (charts.axis == axis) & (np.abs(charts.value - line[index]) < near)
        chart = _on(surface, charts, on)
        group = np.where(chart >= 0, index[chart], -1)
        values = field(matrix, places[:, axis], group, len(line)).values(line)
        found[:, axis] = np.interp(values, line, np.arange(len(line)))
    return OnBricks(drawn.polycube.occupancy, list(drawn.polycube.knots), surface, found)
