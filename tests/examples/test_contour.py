"""Contours compared with known volumes, and solids with known distances."""

import numpy as np
import pytest

from docs.generators.examples import implicit
from docs.generators.examples.contour import contour
from polycube.errors import InputError
from polycube.surface.measures import genus, volume

REACH = np.full(3, 1.6)


def test_volume_of_a_ball_converges_with_the_square_of_the_cell():
    ball = implicit.sphere((0.05, 0.1, -0.02), 1.0)
    errors = [
        abs(volume(contour(ball, -REACH, REACH, cell)) / (4 / 3 * np.pi) - 1)
        for cell in (0.4, 0.2, 0.1)
    ]
    assert errors[2] < 5e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.3)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.3)


def test_sharp_edges_are_preserved():
    box = implicit.box((0.03, 0.02, 0.01), (1.0, 0.83, 0.71))
    found = volume(contour(box, -REACH, REACH, 0.2)) / (8 * 0.83 * 0.71)
    assert found == pytest.approx(1, abs=0.01)  # 0.045 off with edges cut by the grid


@pytest.mark.parametrize("axis", range(3))
def test_torus_has_genus_one_and_its_vertices_are_on_the_surface(axis):
    field = implicit.torus((0, 0, 0), axis, 1.0, 0.3)
    surface = contour(field, -REACH, REACH, 0.15)
    assert genus(surface) == 1
    assert np.abs(field(surface.vertices)).max() < 1e-9
    assert volume(surface) == pytest.approx(2 * np.pi**2 * 0.09, rel=0.05)


def test_solid_that_exceeds_the_box_is_refused():
    with pytest.raises(ValueError, match="leaves the box"):
        contour(implicit.sphere((1, 0, 0), 1.0), -REACH, REACH, 0.2)


def test_grid_too_coarse_is_refused():
    with pytest.raises(InputError, match="not manifold"):
        contour(implicit.torus((0, 0, 0), 2, 1.0, 0.3), -REACH, REACH, 0.45)


POINT = np.array([[3.0, 4.0, 0.0]])


@pytest.mark.parametrize(
    ("field", "distance"),
    [
        (implicit.sphere((0, 0, 0), 1), 4),
        (implicit.box((0, 0, 0), (2, 1, 1)), np.hypot(1, 3)),
        (implicit.box((0, 0, 0), (2, 1, 1), 0.5), np.hypot(1.5, 3.5) - 0.5),
        (implicit.cylinder((0, 0, 0), 2, 2, 9), 3),
        (implicit.cylinder((0, 0, 0), 0, 2, 1), np.hypot(2, 2)),
        (implicit.torus((0, 0, 0), 2, 4, 0.5), 0.5),
        (implicit.capsule((0, 0, 0), (3, 0, 0), 1, 2), 2),
        (implicit.turned(2, [(-1, 2), (1, 2)]), 3),
        (implicit.union(implicit.sphere((0, 0, 0), 1), implicit.sphere((3, 3, 0), 0.25)), 0.75),
        (implicit.difference(implicit.sphere((3, 4, 0), 2), implicit.sphere((3, 4, 0), 1)), 1),
        (
            implicit.intersection(implicit.sphere((0, 0, 0), 1), implicit.box((0, 0, 0), (9,) * 3)),
            4,
        ),
    ],
)
def test_distance_to_a_point(field, distance):
    assert field(POINT) == pytest.approx(distance)


def test_blending_only_adds_and_only_near_both():
    points = np.random.default_rng(0).uniform(-3, 3, (500, 3))
    a, b = implicit.sphere((-1, 0, 0), 1), implicit.sphere((1, 0, 0), 1)
    plain, blended = implicit.union(a, b)(points), implicit.union(a, b, blend=0.5)(points)
    assert (blended <= plain).all() and (plain - blended).max() <= 0.5 / 4
    far = np.abs(a(points) - b(points)) > 0.5
    assert (blended == plain)[far].all() and not (blended == plain).all()
