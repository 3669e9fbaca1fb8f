import numpy as np
import pytest

from polycube.structure.lattice import collapse, lattice
from polycube.structure.rough_map import affine_map, evaluate, fit, identity_map
from polycube.types import RoughMap
from tests.fixtures.polycubes import PRIMITIVES

POLYCUBE = collapse(lattice((2, 1, 1), ("cube", "hole_y"), PRIMITIVES))
LINEAR = np.array([[1.2, 0.3, 0.1], [-0.2, 0.9, 0.4], [0.2, -0.3, 1.5]])
OFFSET = np.array([3.0, -2.0, 5.0])


def cloud(n: int = 800) -> np.ndarray:
    return np.random.default_rng(0).random((n, 3)) * [2, 1, 1]


def bend(points: np.ndarray) -> np.ndarray:
    radius, angle = 2.5 - points[:, 1], points[:, 0] * 0.5
    return 40 * np.stack([radius * np.sin(angle), -radius * np.cos(angle), points[:, 2]], axis=1)


def stretch(points: np.ndarray) -> np.ndarray:
    """Slabs of very unequal widths, as in a rod with two small holes."""
    widths = np.array([0.2, 0.1, 0.3, 1.5, 0.1, 0.3]), np.array([0.1, 0.6, 0.1])
    moved = points.copy()
    for axis, width in enumerate(widths):
        knots = np.arange(len(width) + 1) / 3
        moved[:, axis] = np.interp(points[:, axis], knots, np.append(0, width.cumsum()))
    return moved


def relative_error(rough_map: RoughMap, truth, points: np.ndarray) -> np.ndarray:
    diagonal = np.linalg.norm(np.ptp(truth(points), axis=0))
    return np.linalg.norm(evaluate(rough_map, points) - truth(points), axis=1) / diagonal


def test_identity_and_affine_maps_are_exact_outside_too():
    points = 4 * cloud(50) - 2
    np.testing.assert_allclose(evaluate(identity_map(POLYCUBE), points), points, atol=1e-12)
    mapped = evaluate(affine_map(POLYCUBE, LINEAR, OFFSET), points)
    np.testing.assert_allclose(mapped, points @ LINEAR.T + OFFSET, atol=1e-12)


def test_evaluate_is_trilinear_between_control_positions():
    positions = np.random.default_rng(1).random((3, 2, 2, 3))
    rough_map = RoughMap([0, 0.5, 2], [0, 1], [0, 1], positions)
    at_knots = evaluate(rough_map, np.array([[0, 0, 0], [0.5, 1, 0], [2, 0, 1.0]]))
    np.testing.assert_allclose(at_knots, positions[[0, 1, 2], [0, 1, 0], [0, 0, 1]])
    middle = evaluate(rough_map, np.array([[1.25, 0.5, 0.5]]))
    np.testing.assert_allclose(middle[0], positions[1:].mean(axis=(0, 1, 2)))


def test_fit_recovers_an_affine_map():
    points = cloud()
    rough_map = fit(points, points @ LINEAR.T + OFFSET, POLYCUBE)
    probes = cloud(100) * 1.2
    np.testing.assert_allclose(evaluate(rough_map, probes), probes @ LINEAR.T + OFFSET, atol=1e-9)


def test_fit_follows_a_smooth_bend():
    rough_map = fit(cloud(), bend(cloud()), POLYCUBE)
    assert relative_error(rough_map, bend, cloud(200)).max() < 0.02


def test_fit_follows_slabs_of_unequal_widths():
    """The map is far from affine, but no point is an outlier: it represents the slabs exactly."""
    error = relative_error(fit(cloud(), stretch(cloud()), POLYCUBE), stretch, cloud(200))
    assert error.mean() < 0.015 and error.max() < 0.06


@pytest.mark.parametrize("seed", range(3))
def test_fit_is_robust_to_a_third_of_outliers(seed):
    rng = np.random.default_rng(seed)
    points = cloud()
    targets = bend(points)
    wrong = rng.random(len(points)) < 0.3
    low, high = targets.min(axis=0), targets.max(axis=0)
    targets[wrong] = low + rng.random((wrong.sum(), 3)) * (high - low)
    error = relative_error(fit(points, targets, POLYCUBE), bend, cloud(200))
    assert error.mean() < 0.01 and error.max() < 0.05


def test_fit_preserves_orientation_if_the_points_do_not():
    points = cloud()
    mirrored = points * [1, 1, -1.0]
    rough_map = fit(points, mirrored, POLYCUBE)
    corner = evaluate(rough_map, np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]))
    assert np.linalg.det(corner[1:] - corner[0]) > 0
    folded = points.copy()
    folded[:, 0] = np.abs(points[:, 0] - 0.8)
    positions = fit(points, folded, POLYCUBE).positions
    x = np.diff(positions, axis=0)[:, :-1, :-1]
    y = np.diff(positions, axis=1)[:-1, :, :-1]
    z = np.diff(positions, axis=2)[:-1, :-1]
    assert (np.einsum("...i,...i", x, np.cross(y, z)) > 0).all()


def test_fit_needs_pairs_of_points():
    with pytest.raises(ValueError, match="at least 4 pairs"):
        fit(np.zeros((3, 3)), np.zeros((3, 3)), POLYCUBE)
    with pytest.raises(ValueError, match="at least 4 pairs"):
        fit(np.zeros((8, 3)), np.zeros((9, 3)), POLYCUBE)
