"""Surfaces of points: within a stated distance of the sphere or box they were taken from."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.surface.checks import check_surface
from polycube.surface.clouds.options import Points
from polycube.surface.clouds.reconstruction import reconstruct
from polycube.surface.measures import genus, volume
from tests.fixtures.clouds import SIDES, ball_points, box_distance, box_points, cloud
from tests.fixtures.surfaces import torus

pytest.importorskip("open3d", exc_type=ImportError)

BALL = 4 / 3 * np.pi


def radial(points):
    return np.abs(np.linalg.norm(points, axis=1) - 1)


def test_a_sphere_without_noise():
    surface, made = reconstruct(cloud(ball_points(4000)), Points())
    check_surface(surface)
    assert genus(surface) == 0
    assert radial(surface.vertices).max() < 0.005
    assert volume(surface) == pytest.approx(BALL, rel=0.003)
    assert made.deviation_max < 0.005
    assert made.neighbours == 30 and made.normals_agree == 1


@pytest.mark.slow
def test_distances_fall_with_the_number_of_points():
    means = [
        radial(reconstruct(cloud(ball_points(n)), Points())[0].vertices).mean()
        for n in (1000, 4000, 16000)
    ]
    assert means[0] > 2 * means[1] > 4 * means[2]


def test_noise_and_outliers_of_a_sphere():
    noise = 0.005
    given = cloud(ball_points(4000, noise, outliers=60))
    surface, made = reconstruct(given, Points())
    check_surface(surface)
    assert genus(surface) == 0
    assert radial(surface.vertices).max() < 2 * noise
    assert radial(surface.vertices).mean() < noise / 2
    assert 55 < made.outliers < 120
    assert made.deviation_mean == pytest.approx(noise * np.sqrt(2 / np.pi), rel=0.2)


@pytest.mark.slow
def test_noise_and_outliers_of_a_box():
    """Its edges are rounded: by no more than the width of a cell."""
    surface, made = reconstruct(cloud(box_points(8000, 0.003, outliers=60)), Points())
    check_surface(surface)
    assert genus(surface) == 0
    assert box_distance(surface.vertices).max() < made.cell
    assert box_distance(surface.vertices).mean() < 0.003
    assert volume(surface) == pytest.approx(SIDES.prod(), rel=0.01)


@pytest.mark.slow
def test_a_ring_keeps_its_hole():
    surface = reconstruct(cloud(torus(120, 40).vertices), Points())[0]
    assert genus(surface) == 1


@pytest.mark.parametrize("sign", [1, -1])
def test_normals_of_the_file_are_taken(sign):
    points = ball_points(1000)
    surface, made = reconstruct(cloud(points, sign * points), Points())
    assert made.neighbours is None
    assert volume(surface) == pytest.approx(BALL, rel=0.02)


def test_normals_that_contradict_the_points_are_refused():
    points = ball_points(1000)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(1000, 1))
    with pytest.raises(InputError):
        reconstruct(cloud(points, signs * points), Points())


@pytest.mark.slow
def test_a_side_that_was_not_scanned_is_closed():
    """A box without points below: closed within its spacings, not a bulge of Poisson's."""
    points = box_points()
    given = cloud(points[points[:, 2] > 0])
    surface, made = reconstruct(given, Points())
    check_surface(surface)
    assert made.made_up > 0.1 and made.added > 1000
    assert volume(surface) == pytest.approx(SIDES.prod(), rel=0.11)
    assert box_distance(surface.vertices).max() < 4 * made.spacing
    with pytest.raises(InputError, match="scan the missing parts"):
        reconstruct(given, Points(trim=None))


@pytest.mark.slow
def test_the_same_points_give_the_same_bits():
    given = cloud(ball_points(1000, 0.005))
    first, second = (reconstruct(given, Points())[0] for _ in range(2))
    assert first.vertices.tobytes() == second.vertices.tobytes()
    assert first.faces.tobytes() == second.faces.tobytes()


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("outliers", -1),
        ("neighbours", 2),
        ("depth", 11),
        ("depth", 6.5),
        ("trim", 0),
        ("trim", True),
    ],
)
def test_options_out_of_range_are_refused(option, value):
    with pytest.raises(InputError, match=rf"points\.{option} must be"):
        Points(**{option: value})
