"""The functions themselves beside those of pantr, pygismo and splinepy, on a structured cube."""

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from polycube.registry import build
from polycube.spline.bezier import bezier_points
from tests.fixtures.splines import cube, meshed_box
from tests.oracles.elements import sampled

pytestmark = [pytest.mark.oracles, pytest.mark.filterwarnings("ignore")]

N = 4  # elements a side
LINE = np.array([0.13, 0.71])  # samples of an element, each way
CORNER = {"boxes": [{"box": [0.01, 0.01, 0.01, 0.74, 0.74, 0.74], "level": 1}], "rings": 0}


@pytest.fixture(scope="module")
def refined():
    """27 of 64 elements in eight: points (P, 3) and functions (P, C)."""
    mesh, surface = meshed_box((N, N, N))
    spline = build("spline", {"plugin": "optimal", "refine": CORNER})(surface, mesh)
    assert np.bincount(spline.level).tolist() == [N**3 - 27, 27 * 8]
    points, functions = sampled(spline, LINE)
    return points, functions


def clamped():
    """Knots of a cubic on [0, 1]."""
    return [0.0] * 3 + np.linspace(0, 1, N + 1).tolist() + [1.0] * 3


def distance(ours, theirs):
    """Largest difference of two sets of functions (P, C), each with the one that fits it best."""
    assert ours.shape == theirs.shape
    apart = cdist(ours.T, theirs.T, "chebyshev")
    return apart[linear_sum_assignment(apart)].max()


def test_truncated_functions_are_those_of_pantr(refined):
    bspline = pytest.importorskip("pantr.bspline")
    points, functions = refined
    space = bspline.create_thb_space(bspline.create_uniform_space([3] * 3, [N] * 3))
    space = space.refine_region(0, [0] * 3, [3] * 3, admissible_class=None)
    theirs = np.zeros((*points.shape[:2], space.num_total_basis))
    for element, x in enumerate(points):
        values, numbers = space.tabulate_basis(space.grid.locate(x[0]), x)
        theirs[element][:, numbers] = values
    shape = -1, functions.shape[2]
    assert distance(functions.reshape(shape), theirs.reshape(shape)) < 1e-13


def test_truncated_functions_are_those_of_pygismo(refined):
    gismo = pytest.importorskip("pygismo")
    points, functions = refined
    knots = [gismo.nurbs.gsKnotVector(clamped(), 3) for _ in range(3)]
    basis = gismo.hsplines.gsTHBSplineBasis3(gismo.nurbs.gsTensorBSplineBasis3(*knots))
    basis.refineElements([1, 0, 0, 0, 6, 6, 6])  # level, then a box in elements of that level
    at = points.reshape(-1, 3).T
    values, numbers = basis.eval(at), basis.active(at)
    theirs = np.zeros((at.shape[1], basis.size()))
    np.add.at(theirs, (np.arange(at.shape[1])[None], numbers), values)
    assert distance(functions.reshape(len(theirs), -1), theirs) < 1e-13


def test_bezier_points_are_those_of_splinepy():
    """Of a clamped B-spline volume with control points anywhere."""
    splinepy = pytest.importorskip("splinepy")
    spline = cube(N)
    order = np.lexsort(np.round(spline.control, 9).T)  # x fastest
    control = np.random.default_rng(0).normal(size=(len(order), 3))
    theirs = splinepy.BSpline([3] * 3, [clamped()] * 3, control[order])
    patches = np.stack([patch.control_points for patch in theirs.extract_bezier_patches()])
    ours = (spline.extraction @ control)[spline.nodes]
    place = np.lexsort(np.round(bezier_points(spline).mean(axis=1), 9).T)
    assert ours[place] == pytest.approx(patches, abs=1e-13)
