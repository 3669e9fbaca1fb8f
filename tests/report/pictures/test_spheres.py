"""Spheres are where they should be, in the order in which they are seen."""

import numpy as np
import pytest

from polycube.report.pictures.spheres import spheres

RED, BLUE = [200.0, 0, 0], [0, 0, 200.0]


def one(centre: list[float], colour: list[float] = RED, radius: float = 12.0) -> np.ndarray:
    return spheres(np.array([centre]), np.array([colour]), np.array([radius]), (60, 80))


def test_a_sphere_is_a_disc_of_its_radius_at_its_centre() -> None:
    seen = (one([50, 20, 0]) != 255).any(axis=2)
    assert seen.sum() == pytest.approx(np.pi * 12**2, rel=0.08)
    assert np.argwhere(seen).mean(axis=0) == pytest.approx([20, 50], abs=1)


def test_light_comes_from_the_upper_left() -> None:
    picture = one([40, 30, 0])[..., 0].astype(float)
    assert picture[24, 35] > picture[36, 45] + 50


def test_the_nearer_sphere_hides_the_other() -> None:
    """Also where the spheres enter each other: half-way, each pixel is the nearer one's."""
    for depth, front in ((5, 2), (-5, 0), (30, 2), (-30, 0)):
        both = np.array([[40.0, 30, 0], [40, 30, depth]])
        picture = spheres(both, np.array([RED, BLUE]), np.array([10.0, 10]), (60, 80))
        assert picture[30, 40].argmax() == front


def test_the_order_in_the_array_does_not_matter() -> None:
    rng = np.random.default_rng(0)
    centres, colours = rng.uniform(0, 60, (40, 3)), rng.uniform(0, 255, (40, 3))
    radius = rng.choice([3.0, 7.0], 40)
    turned = rng.permutation(40)
    np.testing.assert_array_equal(
        spheres(centres, colours, radius, (60, 60)),
        spheres(centres[turned], colours[turned], radius[turned], (60, 60)),
    )


def test_what_lies_outside_is_cut_off() -> None:
    assert (one([-40, 30, 0]) == 255).all()
    assert (one([0, 30, 0]) != 255).any()
