"""det J of trilinear hexes: exact polynomials, positive only at corners, dense sampling."""

import numpy as np
import pytest

from polycube.hexmesh.certificate import CHUNK, MAX_NUMBERS, certify, coefficients
from polycube.hexmesh.connectivity import CORNERS, PLACES
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.spline.bernstein import bernstein

ONE = np.arange(8)[None]
# VTK gives it a scaled Jacobian of 0.355, and it is inside out near one of its edges
FALSE_FRIEND = np.array(
    [[1, 0, 2], [2, -2, -2], [3, 2, -1], [2, 2, -1], [2, 1, 6], [5, 0, 5], [5, 4, 4], [-2, 3, 2]]
)


def det_on_grid(corners: np.ndarray, n: int) -> np.ndarray:
    """n^6 det J of a hex of whole coordinates at (n + 1)^3 points, in exact whole numbers."""
    line = np.arange(n + 1)
    at = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 1, 3)
    factors = np.where(PLACES, at, n - at)
    columns = []
    for axis in range(3):
        rest = np.delete(factors, axis, axis=2).prod(axis=2) * np.where(PLACES[:, axis], 1, -1)
        columns.append(rest @ corners)
    a, b, c = columns
    return np.einsum("pi,pi->p", a, np.cross(b, c))


def random_hexes(n: int, amplitude: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    points = 12 * PLACES + np.random.default_rng(seed).integers(
        -int(12 * amplitude), int(12 * amplitude) + 1, size=(n, 8, 3)
    )
    return points.reshape(-1, 3), np.arange(8 * n).reshape(-1, 8)


def test_a_parallelepiped_is_one_everywhere():
    points = PLACES @ [[2.0, 0, 0], [1, 3, 0], [-1, 1, 4]] + 1e3
    found = certify(points, ONE)
    assert coefficients(points[ONE]) == pytest.approx(np.full((1, 27), 24))
    assert found.least == pytest.approx(1) and found.bound == pytest.approx(1)
    assert found.positive[0] and not found.refuted[0]


@pytest.mark.parametrize("top", [0.75, 0.1, 1e-3])
def test_a_frustum_is_least_at_its_top(top):
    """det J = (1 - z + top z)^2, its mean (1 + top + top^2) / 3."""
    points = (PLACES - [0.5, 0.5, 0]) * np.where(PLACES[:, 2:], [top, top, 1], 1)
    found = certify(points, ONE)
    assert found.least[0] == pytest.approx(3 * top**2 / (1 + top + top**2), rel=1e-5)
    assert found.bound[0] == pytest.approx(found.least[0]) and found.positive[0]


def test_pyramids_and_mirrored_hexes_are_refused():
    pyramid = (PLACES - [0.5, 0.5, 0]) * np.where(PLACES[:, 2:], [0, 0, 1], 1)
    for points in (pyramid, PLACES * [-1, 1, 1], PLACES * [1, 1, 0]):
        found = certify(points.astype(float), ONE)
        assert found.refuted[0] and not found.positive[0]


def test_positive_corners_and_a_negative_interior_are_refused():
    corners = FALSE_FRIEND[CORNERS[:, 1:]] - FALSE_FRIEND[CORNERS[:, :1]]
    assert (np.linalg.det(corners) > 0.5).all()
    assert scaled_jacobian(FALSE_FRIEND, ONE)[0] > 0.35
    assert det_on_grid(FALSE_FRIEND, 24).min() < 0  # exact
    found = certify(FALSE_FRIEND.astype(float), ONE)
    assert found.refuted[0] and not found.positive[0]
    assert found.least[0] < 0


def test_coefficients_are_those_of_det_j():
    points, hexes = random_hexes(4, 0.4, 3)
    b = bernstein(np.arange(7) / 6, 2)
    values = np.einsum(
        "ai,bj,ck,hijk->habc", b, b, b, coefficients(points[hexes]).reshape(4, 3, 3, 3)
    )
    for hexa, found in zip(points[hexes], values.reshape(4, -1), strict=True):
        np.testing.assert_allclose(found, det_on_grid(hexa, 6) / 6**6, rtol=1e-9, atol=1e-8)


def test_certificate_agrees_with_dense_samples():
    points, hexes = random_hexes(600, 0.42, 0)
    found = certify(points.astype(float), hexes)
    assert (found.positive | found.refuted).all()
    least = np.array([det_on_grid(points[h], 6).min() for h in hexes])
    assert (least[found.positive] > 0).all()
    narrow = hexes[found.refuted & (least > 0)]
    assert all(det_on_grid(points[h], 48).min() <= 0 for h in narrow)
    hard = (coefficients(points[hexes].astype(float)).min(axis=1) < 0) & found.positive
    assert hard.sum() > 4  # positive hexes whose own coefficients do not show it


def test_a_zero_that_no_halving_meets_is_left_undecided():
    """det J = (1 - 3/2 z)^2 is zero on a plane between all corners of halved boxes."""
    points = (PLACES - [0.5, 0.5, 0]) * np.where(PLACES[:, 2:], [-0.5, -0.5, 1], 1)
    found = certify(points, ONE)
    assert not found.positive[0] and not found.refuted[0]
    assert found.least[0] == pytest.approx(0, abs=1e-3) and found.bound[0] <= 0


def test_too_few_halvings_leave_a_hex_undecided():
    """So many undecided hexes at once that none of them is halved."""
    points, hexes = random_hexes(600, 0.42, 0)
    points = points.astype(float)
    inner = coefficients(points[hexes])
    is_open = (inner.min(axis=1) < 0) & (inner[:, [0, 2, 6, 8, 18, 20, 24, 26]].min(axis=1) > 0)
    hexes, times = hexes[is_open], MAX_NUMBERS // 27 // 8 // is_open.sum() + 1
    full = certify(points, hexes)
    found = certify(points, np.tile(hexes, (times, 1)))
    undecided = ~found.positive & ~found.refuted
    assert (undecided & np.tile(full.positive, times)).any()
    assert not (found.positive & ~np.tile(full.positive, times)).any()


def test_result_is_independent_of_units_and_placement():
    points, hexes = random_hexes(100, 0.3, 1)
    once = certify(points.astype(float), hexes)
    again = certify(1e-6 * points + 5.0, hexes)
    np.testing.assert_array_equal(once.positive, again.positive)
    np.testing.assert_allclose(again.least, once.least, rtol=1e-3, atol=1e-6)


def test_result_is_independent_of_chunks():
    points, hexes = random_hexes(100, 0.1, 1)
    once, times = certify(points.astype(float), hexes), CHUNK // 100 + 1
    again = certify(points.astype(float), np.tile(hexes, (times, 1)))
    np.testing.assert_array_equal(again.least, np.tile(once.least, times))
    np.testing.assert_array_equal(again.bound, np.tile(once.bound, times))
