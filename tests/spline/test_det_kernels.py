import numpy as np
import pytest

from polycube.spline.bernstein import gauss, volume_basis
from polycube.spline.det_kernels import detj, least_detj, squared_shortfall

LINE = np.array([0.0, 0.3, 0.5, 1.0])
SIZES = [1, 16, 17, 600]  # elements: one, all lanes, one more, several threads


def nets(number, seed=0):
    """Points (B, 3) and nodes (E, 64) of elements that share many."""
    rng = np.random.default_rng(seed)
    cube = np.stack(np.meshgrid(*[np.arange(4) / 3] * 3, indexing="ij"), axis=-1)[..., ::-1]
    points = np.tile(cube.reshape(-1, 3), (number // 2 + 1, 1))
    nodes = np.stack([np.arange(64) + 64 * (e // 2) for e in range(number)])
    return points + rng.uniform(-0.15, 0.15, points.shape), nodes


def reference(points, nodes, line):
    """Tangents (E, q, 3, 3) from the complete tables of the basis."""
    _, gradients = volume_basis(line)
    return np.einsum("aqm,emc->eqac", gradients, points[nodes])


@pytest.mark.parametrize("number", SIZES)
def test_values_are_determinants_of_the_tangents(number):
    points, nodes = nets(number)
    expected = np.linalg.det(reference(points, nodes, LINE))
    assert detj(points, nodes, LINE) == pytest.approx(expected, rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("number", SIZES)
def test_least_values_and_volumes(number):
    points, nodes = nets(number)
    line, weights = gauss(5)
    values = detj(points, nodes, line)
    least, volume = least_detj(points, nodes, line, weights)
    cube = np.einsum("k,j,i->kji", weights, weights, weights).ravel()
    assert least == pytest.approx(values.min(axis=1), rel=1e-13)
    assert volume == pytest.approx(values @ cube, rel=1e-13)


def test_no_elements_have_no_values():
    points, nodes = nets(2)
    assert detj(points, nodes[:0], LINE).shape == (0, 64)
    assert [len(part) for part in least_detj(points, nodes[:0], LINE, LINE)] == [0, 0]


@pytest.mark.parametrize("number", SIZES)
def test_shortfall_and_its_derivatives_agree_with_the_values(number):
    points, nodes = nets(number)
    unit = np.random.default_rng(1).uniform(0.5, 2, number)
    value, slope = squared_shortfall(points, nodes, LINE, unit, 0.8)
    tangents = reference(points, nodes, LINE)
    det = np.linalg.det(tangents)
    lack = np.maximum(0.8 - det / unit[:, None], 0)
    assert 0 < (lack > 0).mean() < 1
    assert value == pytest.approx((lack**2).sum(), rel=1e-12)
    cofactors = det[..., None, None] * np.linalg.inv(tangents).swapaxes(2, 3)
    by_tangent = (-2 * lack / unit[:, None])[..., None, None] * cofactors
    expected = np.zeros_like(points)
    np.add.at(expected, nodes, np.einsum("aqm,eqac->emc", volume_basis(LINE)[1], by_tangent))
    assert slope == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_no_shortfall_above_the_floor():
    points, nodes = nets(20)
    value, slope = squared_shortfall(points, nodes, LINE, np.ones(20), -100.0)
    assert value == 0 and not slope.any()
