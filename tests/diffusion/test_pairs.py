"""Pairs: seeded, in the learning frame, corresponding point by point."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.diffusion.deformation import Deformation
from polycube.diffusion.pairs import Pairs, sample
from polycube.diffusion.templates import template
from polycube.geometry.projection import project

OFF = Deformation(0, 0, 0, 0, 0, 0, 0, 0, 0, 0)


def test_a_pair_depends_on_seed_and_number_only(pairs: Pairs, primitives: dict) -> None:
    again = Pairs(pairs.grid, primitives, pairs.contexts, pairs.deformation, seed=0)
    again(5)
    assert np.array_equal(pairs(31).geometry, again(31).geometry)
    other = Pairs(pairs.grid, primitives, pairs.contexts, pairs.deformation, seed=1)
    assert not np.array_equal(pairs(31).geometry, other(31).geometry)
    assert not np.array_equal(pairs(31).geometry, pairs(31 + 24).geometry)


@settings(derandomize=True, max_examples=24, deadline=None)
@given(index=st.integers(0, 10**9))
def test_geometry_fills_the_frame_and_polycube_lies_on_its_boundary(
    pairs: Pairs, primitives: dict, index: int
) -> None:
    pair = pairs(index)
    assert pair.geometry.shape == pair.polycube.shape == (1024, 3)
    assert pair.context == pairs.contexts[index % 24]
    assert 0.9 < np.abs(pair.geometry).max() < 1.05
    shape = pairs._template(pair.context)
    points = pair.polycube + np.array([1, 0.5, 0.5])
    assert np.abs(project(shape.polycube, points)[0] - points).max() < 1e-12


def test_without_deformation_the_geometry_is_the_polycube(primitives: dict) -> None:
    pair = Pairs((2, 1, 1), primitives, [("hole_x", "cube")], OFF, seed=0)(0)
    assert pair.geometry == pytest.approx(pair.polycube, abs=1e-12)


@pytest.mark.parametrize("name", [f for f in Deformation.__dataclass_fields__ if f != "roughness"])
def test_each_step_alone_deforms(name: str, primitives: dict) -> None:
    shape = template((2, 1, 1), ("hole_y", "cube"), primitives)
    deformation = replace(OFF, **{name: getattr(Deformation(), name)})
    moved = [
        np.abs(deformation.deform(shape, np.random.default_rng(s)) - shape.vertices).max()
        for s in range(8)
    ]
    assert max(moved) > 0.02


def test_warp_keeps_the_order_of_points_along_each_axis(primitives: dict) -> None:
    shape = template((2, 1, 1), ("hole_y", "cube"), primitives)
    moved = replace(OFF, warp=1.0).deform(shape, np.random.default_rng(0))
    for axis in range(3):
        order = np.argsort(shape.vertices[:, axis], kind="stable")
        assert (np.diff(moved[order, axis]) > -1e-12).all()


def test_disc_makes_a_square_section_round(primitives: dict) -> None:
    """At full strength the corners of the box come to the circle, the middles stay."""
    shape = template((1, 1, 1), ("cube",), primitives)
    radius = []
    for seed in range(40):
        moved = replace(OFF, disc=1.0).deform(shape, np.random.default_rng(seed))
        for a, b in ((0, 1), (0, 2), (1, 2)):
            radius.append(np.hypot(moved[:, a], moved[:, b]).max())
    assert min(radius) == pytest.approx(0.5, abs=0.03)


def test_samples_are_uniform_on_the_geometry(primitives: dict) -> None:
    """A cube stretched four times along x: its ends have 2 of 18 units of area."""
    shape = template((1, 1, 1), ("cube",), primitives)
    stretched = shape.vertices * [4, 1, 1]
    geometry, polycube = sample(shape, stretched, 20000, np.random.default_rng(0))
    at_end = np.isclose(np.abs(geometry[:, 0]), 2)
    assert at_end.mean() == pytest.approx(2 / 18, abs=0.01)
    assert geometry == pytest.approx(polycube * [4, 1, 1], abs=1e-12)
