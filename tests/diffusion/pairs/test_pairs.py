"""Pairs: seeded, in the learning frame, corresponding point by point."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.pairs import Pairs, sample
from polycube.diffusion.pairs.templates import template
from polycube.structure.lattice import lattice
from polycube.structure.projection import project
from polycube.surface.measures import volume
from polycube.types import TriMesh

STEPS = [field.name for field in fields(Deformation)]
OFF = Deformation(**dict.fromkeys(STEPS, 0.0))
OUTWARD = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]


def test_a_pair_depends_on_seed_and_number_only(pairs: Pairs, primitives: dict) -> None:
    same = Pairs(pairs.grid, primitives, pairs.contexts, pairs.deformation, seed=0)
    same(5)
    assert np.array_equal(pairs(31).geometry, same(31).geometry)
    other = Pairs(pairs.grid, primitives, pairs.contexts, pairs.deformation, seed=1)
    assert np.array_equal(pairs(31).normals, same(31).normals)
    assert not np.array_equal(pairs(31).geometry, other(31).geometry)
    assert not np.array_equal(pairs(31).geometry, pairs(31 + 24).geometry)


@pytest.mark.slow
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
    """To the single precision of the templates."""
    pair = Pairs((2, 1, 1), primitives, [("hole_x", "cube")], OFF, seed=0)(0)
    assert pair.geometry == pytest.approx(pair.polycube, abs=1e-6)
    assert pair.normals == pytest.approx(np.array(OUTWARD)[pair.labels[:, 0]], abs=1e-6)


@pytest.mark.parametrize("number", range(24))
def test_labels_are_of_the_face_that_a_point_lies_on(
    number: int, pairs: Pairs, primitives: dict
) -> None:
    """Point by point: solid a little inwards, empty a little outwards, in which cells."""
    pair = pairs(number)
    solid = lattice(pairs.grid, pair.context, primitives).occupancy
    for point, (axis, cell, wall) in zip(pair.polycube[::16], pair.labels[::16], strict=True):
        inwards, outwards = (
            (point + [1, 0.5, 0.5] + side * 1e-6 * np.array(OUTWARD[axis])) for side in (-1, 1)
        )
        assert solid[tuple(np.floor(3 * inwards).astype(int))]
        voxel = np.floor(3 * outwards).astype(int)
        assert not ((voxel >= 0).all() and (voxel < solid.shape).all() and solid[tuple(voxel)])
        assert cell == int(inwards[0])
        into = np.floor(outwards).astype(int)
        hole = into[0] in (0, 1) and not into[1:].any() and pair.context[into[0]] is not None
        assert wall == hole


@pytest.mark.parametrize("number", [0, 7, 19])
def test_normals_are_those_of_the_deformed_surface(
    number: int, pairs: Pairs, primitives: dict
) -> None:
    """Of the one triangle that a point lies in, found by looking at all of them."""
    smooth = replace(pairs.deformation, roughness=0.0, tilt=0.0)
    pair = Pairs(pairs.grid, primitives, pairs.contexts, smooth, seed=0)(number)
    shape = pairs._template(pair.context)
    deformed = smooth.deform(shape, np.random.default_rng([0, number]))
    deformed = learning_frame(deformed).apply(deformed)
    assert volume(TriMesh(deformed, shape.faces)) > 0  # so that counter-clockwise is outward
    a, b, c = deformed[shape.faces].transpose(1, 0, 2)
    cross = np.cross(b - a, c - a)
    unit = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    for point, normal in zip(pair.geometry[::32], pair.normals[::32], strict=True):
        parts = [  # areas that the point makes with the edges, as shares; 0 to 1 inside
            (np.cross(q - p, point - p) * unit).sum(axis=1) / np.linalg.norm(cross, axis=1)
            for p, q in ((a, b), (b, c), (c, a))
        ]
        flat = np.abs(((point - a) * unit).sum(axis=1)) < 1e-9
        (face,) = np.flatnonzero(flat & (np.min(parts, axis=0) > -1e-9))
        assert normal == pytest.approx(unit[face], abs=1e-9)


def test_tilt_turns_normals_and_leaves_them_unit(pairs: Pairs, primitives: dict) -> None:
    """By tan^-1 of two normal deviates: a root mean square near the drawn 0 to 0.1 radians."""
    straight = replace(pairs.deformation, tilt=0.0)
    exact = Pairs(pairs.grid, primitives, pairs.contexts, straight, seed=0)
    for number in range(4):
        normals, tilted = exact(number).normals, pairs(number).normals
        assert np.linalg.norm(tilted, axis=1) == pytest.approx(1, abs=1e-12)
        angle = np.arccos(np.clip((normals * tilted).sum(axis=1), -1, 1))
        assert 1e-4 < np.sqrt((angle**2).mean() / 2) < 0.11


@pytest.mark.parametrize("name", [s for s in STEPS if s not in ("roughness", "tilt")])
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
    face, weights = sample(shape.faces, stretched, 20000, np.random.default_rng(0))
    assert weights.min() >= 0 and weights.sum(axis=1) == pytest.approx(1)
    points = np.einsum("nk,nkd->nd", weights, stretched[shape.faces[face]])
    assert np.isclose(np.abs(points[:, 0]), 2).mean() == pytest.approx(2 / 18, abs=0.01)
    assert points[:, 0].mean() == pytest.approx(0, abs=0.03)
