"""Meshes that are fitted as far as they stay valid."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.fitting.uncrossing import LEAST, is_sound, partly_fitted, with_layer
from polycube.hexmesh.connectivity import genus, hex_mesh
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from tests.fixtures.hexmeshes import hex_box, surface_of, unit_cubes


def least_of(mesh):
    return scaled_jacobian(mesh.vertices, mesh.hexes).min()


def test_a_valid_fitted_mesh_is_the_result():
    mesh = hex_box((3, 3, 3))
    fitted = 2 * mesh.vertices + 0.1 * np.sin(5 * mesh.vertices[:, ::-1])
    found, share = partly_fitted(mesh, fitted)
    assert np.array_equal(found.vertices, fitted)
    assert (share == 1).all()


def test_only_a_vertex_that_would_invert_its_hexes_is_moved_back():
    mesh = hex_box((9, 3, 3), (9.0, 3.0, 3.0))
    fitted = mesh.vertices.copy()
    fitted[0] = [1.5, 1.5, 1.5]  # through the hex at this corner
    found, share = partly_fitted(mesh, fitted)
    assert least_of(found) >= LEAST
    assert 0 < share[0] < 1
    assert np.array_equal(found.vertices[1:], fitted[1:])


def test_a_hex_below_the_limit_does_not_become_worse():
    mesh = hex_box()
    flat = mesh.vertices.copy()
    flat[0] = 0.164
    start = replace(mesh, vertices=flat)
    assert 0 < least_of(start) < LEAST
    found, _ = partly_fitted(start, flat + np.array([0.5, 0, 0]))
    assert least_of(found) == pytest.approx(least_of(start))
    assert np.array_equal(found.vertices, flat + np.array([0.5, 0, 0]))


def horseshoe():
    """A bar bent into a U: its arms, two cells apart, are three cells long."""
    missing = [(x, 0, z) for x in (1, 2) for z in (1, 2, 3)]
    return hex_mesh(*unit_cubes(4, 1, 4, missing))


def test_arms_that_would_cross_each_other_stay_apart():
    mesh = horseshoe()
    fitted = mesh.vertices.copy()
    side = np.where(fitted[:, 0] < 2, 1, -1) * np.maximum(fitted[:, 2] - 1, 0)
    fitted[:, 0] += side  # sheared towards each other, and through
    crossing = replace(mesh, vertices=fitted)
    assert least_of(crossing) > 0 and len(crossings(crossing))
    found, share = partly_fitted(mesh, fitted)
    assert is_sound(found)
    low = mesh.vertices[:, 2] <= 1
    assert np.array_equal(found.vertices[low], fitted[low])
    assert share.mean() > 0.5


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.floats(0, 3), share=st.floats(0, 1), bent=st.booleans())
def test_random_positions_never_make_a_mesh_invalid(seed, size, share, bent):
    mesh = horseshoe() if bent else hex_box((3, 2, 4), (3.0, 2.0, 4.0))
    random = np.random.default_rng(seed)
    moved = random.random(len(mesh.vertices)) < share
    fitted = mesh.vertices + size * moved[:, None] * random.normal(size=mesh.vertices.shape)
    found, gone = partly_fitted(mesh, fitted)
    assert is_sound(found)
    assert ((gone >= 0) & (gone <= 1)).all()
    between = mesh.vertices + gone[:, None] * (fitted - mesh.vertices)
    assert found.vertices == pytest.approx(between)
    if (
        is_sound(replace(mesh, vertices=fitted))
        and least_of(replace(mesh, vertices=fitted)) > LEAST
    ):
        assert np.array_equal(found.vertices, fitted)


def test_invalid_input_is_refused():
    mesh = hex_box()
    with pytest.raises(ValueError, match="shape"):
        partly_fitted(mesh, mesh.vertices[1:])
    with pytest.raises(ValueError, match="finite"):
        partly_fitted(mesh, np.full_like(mesh.vertices, np.nan))
    mirrored = replace(mesh, vertices=mesh.vertices * [-1, 1, 1])
    with pytest.raises(ValueError, match="positive"):
        partly_fitted(mirrored, mesh.vertices)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_layer_is_sound_and_changes_no_topology(seed):
    from polycube.plugins.structure.overlay.planes import manifold

    full = manifold(np.random.default_rng(seed).random((4, 5, 3)), 0.5)
    missing = [tuple(each) for each in np.argwhere(~full).tolist()]
    mesh = hex_mesh(*unit_cubes(*full.shape, missing))
    found = with_layer(mesh, target(surface_of(mesh)))
    assert is_sound(found)
    assert genus(found) == genus(mesh)
    assert len(found.hexes) in (len(mesh.hexes), len(mesh.hexes) + len(mesh.quads))


def test_a_box_has_a_layer():
    mesh = hex_box()
    assert len(with_layer(mesh, target(surface_of(mesh))).hexes) == 8 + 24
