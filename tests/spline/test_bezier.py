from dataclasses import replace

import numpy as np
import pytest

from polycube.spline.bernstein import gauss, tensor, volume_basis
from polycube.spline.bezier import bezier_points, min_detj, scaled_bounds, scaled_detj
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder


def spline_of(mesh):
    return volumetric_spline(mesh, single_hex_edges(mesh))


def moved(spline, amount, seed=0):
    shift = np.random.default_rng(seed).uniform(-amount, amount, spline.control.shape)
    return replace(spline, control=spline.control + shift)


def dense_detj(spline, t):
    _, gradients = volume_basis(t)
    points = bezier_points(spline)
    return np.linalg.det(np.einsum("aqn,enc->eqac", gradients, points, optimize=True))


def test_affine_box_is_exact():
    spline = spline_of(hex_box((3, 4, 5), (2.0, 1.5, 0.7)))
    matrix = np.array([[1.0, 0.4, -0.2], [0.0, 1.1, 0.3], [0.5, 0.0, 0.9]])
    volume = 2.0 * 1.5 * 0.7 * np.linalg.det(matrix)
    found = min_detj(replace(spline, control=spline.control @ matrix.T))
    assert found.volume == pytest.approx(volume, rel=1e-13)
    assert found.min_detj == pytest.approx(volume / 60, rel=1e-12)
    assert found.lower_bound == pytest.approx(volume / 60, rel=1e-7)
    assert found.min_scaled_detj == pytest.approx(1, rel=1e-12)


def test_volume_is_that_inside_the_boundary():
    spline = moved(spline_of(hex_box((2, 2, 2))), 0.0)
    inner = (spline.control == 0.5).all(axis=1)
    control = spline.control + 0.1 * inner[:, None]  # the boundary stays
    assert min_detj(replace(spline, control=control)).volume == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("amount", [0.02, 0.1, 0.2])
@pytest.mark.parametrize("solid", [hex_ball(2), hex_cylinder(2, 2, 2)], ids=["ball", "cylinder"])
def test_bound_is_below_all_samples_and_close_to_the_least(solid, amount):
    spline = moved(spline_of(solid), amount)
    found = min_detj(spline)
    values = dense_detj(spline, np.linspace(0, 1, 17))
    assert found.lower_bound <= found.min_detj <= values.min() + 1e-12
    mean = found.volume / len(spline.nodes)
    assert found.min_detj - found.lower_bound < 2e-6 * mean
    element = np.unravel_index(values.argmin(), values.shape)[0]
    assert found.element == element
    t, w = gauss(5)
    volumes = dense_detj(spline, t) @ tensor(*[w[None]] * 3)[0]
    assert volumes.sum() == pytest.approx(found.volume, rel=1e-12)
    assert found.min_scaled_detj == pytest.approx((values.min(axis=1) / volumes).min(), rel=0.03)


@pytest.mark.parametrize("amount", [0.02, 0.2])
def test_each_element_has_a_bound_below_its_samples_and_close(amount):
    spline = moved(spline_of(hex_ball(2)), amount)
    t, w = gauss(5)
    volumes = dense_detj(spline, t) @ tensor(*[w[None]] * 3)[0]
    least = dense_detj(spline, np.linspace(0, 1, 17)).min(axis=1) / volumes
    bound = scaled_bounds(spline)
    assert (bound <= least + 1e-12).all()
    assert (bound >= least - 0.05).all()
    assert (bound <= scaled_detj(spline) + 1e-12).all()


def test_bounds_of_a_box_are_one():
    assert scaled_bounds(spline_of(hex_box((2, 3, 1)))) == pytest.approx(np.ones(6), rel=1e-8)


@pytest.mark.slow
def test_position_of_the_least_value():
    spline = moved(spline_of(hex_ball(2)), 0.1)
    found = min_detj(spline)
    values = dense_detj(spline, np.linspace(0, 1, 41))[found.element]
    basis, _ = volume_basis(np.linspace(0, 1, 41))
    place = (basis @ bezier_points(spline)[found.element])[values.argmin()]
    assert found.position == pytest.approx(place, abs=0.02)


def test_inverted_and_flat_elements_are_found():
    spline = spline_of(hex_box((2, 2, 2)))
    mirrored = min_detj(replace(spline, control=spline.control * [-1, 1, 1]))
    assert mirrored.min_detj == pytest.approx(-1 / 8)
    assert (mirrored.volume, mirrored.min_scaled_detj) == pytest.approx((-1, -1))
    flat = min_detj(replace(spline, control=spline.control * [0, 1, 1]))
    assert flat.min_detj == flat.volume == flat.min_scaled_detj == 0
