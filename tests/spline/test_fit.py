from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import identity

from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.hex_meshes import boundary
from polycube.spline.bezier import min_detj, scaled_detj
from polycube.spline.boundary import grid, sampling
from polycube.spline.fit import Fit
from polycube.spline.positive import restored, shares
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from polycube.spline.surface_fit import fit_to_surface
from polycube.types import TriMesh
from polycube.types.checks import options_of
from tests.fixtures.hexmeshes import hex_ball, hex_box


def spline_of(mesh):
    return volumetric_spline(mesh, single_hex_edges(mesh))


def outside(spline, pieces):
    """Points on every boundary face."""
    at, _, _ = sampling(spline, *grid(np.arange(pieces + 1) / pieces))
    return at @ (spline.extraction @ spline.control)


def ball_surface(n=16):
    """A finely divided sphere of radius 1."""
    mesh = hex_box((n, n, n))
    surface = boundary(hex_mesh(mesh.vertices - 0.5, mesh.hexes))
    points = surface.vertices / np.linalg.norm(surface.vertices, axis=1, keepdims=True)
    return TriMesh(points, surface.faces)


def test_a_box_is_unchanged():
    mesh = hex_box((3, 4, 5), (2.0, 1.5, 0.7))
    spline = spline_of(mesh)
    assert fit_to_surface(Fit(), spline, boundary(mesh)) is spline


def test_a_shrunk_box_is_restored():
    mesh = hex_box((3, 3, 3))
    spline = spline_of(mesh)
    small = replace(spline, control=0.5 + 0.97 * (spline.control - 0.5))
    fitted = fit_to_surface(Fit(), small, boundary(mesh))
    found = outside(fitted, 4)
    gap = np.minimum(np.abs(found), np.abs(1 - found)).min(axis=1)
    assert gap.max() < 1e-3
    assert min_detj(fitted).volume == pytest.approx(1, rel=1e-3)


def ball(n, pieces=16):
    """The spline of a ball with radius 1 before and after."""
    spline = spline_of(hex_ball(n))
    return spline, fit_to_surface(Fit(), spline, ball_surface(pieces))


@pytest.fixture(scope="module")
def coarse():
    return ball(3)


def off_sphere(spline):
    radius = np.linalg.norm(outside(spline, 3), axis=1)
    return np.sqrt(np.mean((radius - 1) ** 2))


def test_a_ball_has_its_radius_and_volume(coarse):
    before, after = coarse
    assert off_sphere(after) < 0.2 * off_sphere(before)
    volume = 4 / 3 * np.pi
    assert abs(min_detj(after).volume / volume - 1) < 0.01
    assert abs(min_detj(before).volume / volume - 1) > 0.1


@pytest.mark.slow
def test_the_radius_converges_with_nearly_the_fourth_order():
    coarse, fine = (off_sphere(ball(n, pieces=48)[1]) for n in (3, 6))  # facets: 1e-4 off
    assert np.log2(coarse / fine) > 3.5


def test_det_j_stays_positive_and_is_raised(coarse):
    before, after = map(min_detj, coarse)
    assert after.min_scaled_detj > 2 * before.min_scaled_detj
    assert after.lower_bound > 0


def test_any_space_is_fitted():
    mesh = hex_ball(2)
    plain = spline_of(mesh)
    surface = boundary(mesh)
    every = np.arange(plain.extraction.shape[0])
    free = replace(
        plain,
        control=plain.extraction @ plain.control,
        extraction=identity(len(every), format="csr"),
    )
    fitted = fit_to_surface(Fit(), free, surface)
    least = min(min_detj(free).min_scaled_detj, 0.1)
    assert min_detj(fitted).min_scaled_detj > least - 1e-9


def test_an_inverted_element_is_repaired():
    mesh = hex_box((3, 3, 3))
    spline = spline_of(mesh)
    inner = np.flatnonzero(((mesh.vertices > 0.1) & (mesh.vertices < 0.9)).all(axis=1))
    control = spline.control.copy()
    control[inner[0]] += 0.7  # beyond its opposite
    folded = replace(spline, control=control)
    assert min_detj(folded).min_detj < 0
    shrunk = replace(folded, control=0.5 + 0.98 * (control - 0.5))
    assert min_detj(fit_to_surface(Fit(), shrunk, boundary(mesh))).lower_bound > 0


def test_a_move_is_reverted_if_det_j_would_decrease():
    spline = spline_of(hex_box((6, 2, 2), (3.0, 1.0, 1.0)))
    rng = np.random.default_rng(0)
    moved = spline.control + 0.02 * rng.standard_normal(spline.control.shape)
    end = spline.control[:, 0] < 0.6
    moved[end] += 0.6 * rng.standard_normal((end.sum(), 3))
    floor = np.full(len(spline.nodes), 0.3)
    assert scaled_detj(replace(spline, control=moved)).min() < 0
    found = restored(spline, moved, floor, shares(spline))
    assert (scaled_detj(replace(spline, control=found)) >= floor).all()
    assert np.array_equal(found[end], spline.control[end])
    far = spline.control[:, 0] > 2.9
    assert np.array_equal(found[far], moved[far])


def test_a_positive_spline_stays_positive():
    mesh = hex_ball(2)
    spline, ledge = spline_of(mesh), boundary(hex_box((3, 3, 3), (0.8, 1.6, 0.3)))
    aside = np.array([0.5, -0.8, 0.2])
    crushed = TriMesh(ledge.vertices + aside, ledge.faces)  # no place for this ball
    before, after = (min_detj(s) for s in (spline, fit_to_surface(Fit(rounds=0), spline, crushed)))
    assert after.lower_bound > 0
    assert after.min_scaled_detj >= min(before.min_scaled_detj, 0.1) - 1e-9


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"iterations": -1}, "fit.iterations must be a whole number, 0 or more; got -1"),
        ({"rounds": 1.5}, "fit.rounds must be a whole number, 0 or more; got 1.5"),
        ({"floor": 1}, r"fit.floor must be a number, above 0 and below 1; got 1"),
        ({"floor": "x"}, "fit.floor must be a number, above 0 and below 1; got 'x'"),
        ({"steps": 3}, "fit takes iterations, floor, rounds; got 'steps'"),
    ],
)
def test_invalid_options_are_refused_with_a_reason(options, message):
    with pytest.raises(ValueError, match=message):
        options_of("fit", Fit, options)
