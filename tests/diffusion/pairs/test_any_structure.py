"""Pairs of any structure: seeded, in the learning frame, corresponding point by point."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from multiprocessing import get_context

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import LatticePair, LatticePairs, LatticeShapes
from polycube.diffusion.pairs.cad_shapes import CadShapes
from polycube.diffusion.pairs.deformation import Deformation
from polycube.structure.lattice import collapse, is_manifold
from polycube.surface.measures import volume
from polycube.types import TriMesh

OUTWARD = np.kron(np.eye(3), [[1], [-1]])
SHARP = CadShapes(**{field.name: 0.0 for field in fields(CadShapes)})
STILL = Deformation(**{field.name: 0.0 for field in fields(Deformation)})
PLAIN = LatticeShapes(cad=1, organic=0, shapes=SHARP, deformation=STILL)


@pytest.fixture(scope="module")
def pairs() -> list[LatticePair]:
    return [LatticePairs(0, 256)(i) for i in range(60)]


@pytest.mark.slow
def test_a_pair_depends_on_seed_and_number_only() -> None:
    stream = LatticePairs(0, 64)
    first = stream(31)
    stream(5)
    same, other = stream(31), LatticePairs(1, 64)(31)
    assert np.array_equal(first.geometry, same.geometry)
    assert np.array_equal(first.labels, same.labels)
    assert not np.array_equal(first.geometry, other.geometry)


@pytest.mark.slow
def test_another_process_makes_the_same_pairs() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = list(pool.map(LatticePairs(3, 64), range(6)))
    for number, pair in enumerate(there):
        here = LatticePairs(3, 64)(number)
        for field in ("geometry", "normals", "polycube", "labels"):
            assert np.array_equal(getattr(here, field), getattr(pair, field))
        assert np.array_equal(here.solid.x, pair.solid.x)


def test_views_of_a_part_are_the_part_turned() -> None:
    """Labels stay those of the face that a point lies on; the first view is the part itself."""
    stream, plain = LatticePairs(0, 256, PLAIN, views=3), LatticePairs(0, 256, PLAIN)
    for number in range(8):
        first, *others = (stream(3 * number + view) for view in range(3))
        assert np.array_equal(first.geometry, plain(number).geometry)
        for pair in others:
            assert sorted(pair.solid.occupancy.shape) == sorted(first.solid.occupancy.shape)
            assert pair.geometry == pytest.approx(pair.polycube, abs=1e-12)
            assert_on_faces(pair)
    same = LatticePairs(0, 256, PLAIN, views=3)(22)
    assert np.array_equal(same.labels, stream(22).labels)


def test_both_sides_are_in_the_learning_frame(pairs: list[LatticePair]) -> None:
    for pair in pairs:
        assert pair.geometry.shape == pair.normals.shape == pair.polycube.shape == (256, 3)
        assert np.abs(pair.geometry).max() < 1.05
        ends = np.array([[knots[0], knots[-1]] for knots in pair.solid.knots])
        assert ends.sum(axis=1) == pytest.approx(0, abs=1e-12)
        assert ends.max() == pytest.approx(1)
        assert np.linalg.norm(pair.normals, axis=1) == pytest.approx(1)


def test_the_polycube_is_a_collapsed_manifold_without_slivers(pairs: list[LatticePair]) -> None:
    for pair in pairs:
        assert is_manifold(pair.solid)
        assert collapse(pair.solid).occupancy.shape == pair.solid.occupancy.shape
        assert min(np.diff(knots).min() for knots in pair.solid.knots) > 0.03


def test_labels_are_of_the_face_that_a_point_lies_on(pairs: list[LatticePair]) -> None:
    for pair in pairs:
        assert_on_faces(pair)


def assert_on_faces(pair: LatticePair) -> None:
    """On the plane of its knot; solid a little inwards, empty a little outwards."""
    axis, number = pair.labels.T
    for a, knots in enumerate(pair.solid.knots):
        own = axis // 2 == a
        assert np.abs(pair.polycube[own, a] - knots[number[own]]).max(initial=0) < 1e-12
    full = np.pad(pair.solid.occupancy, 1)
    for side, expected in ((-1e-9, True), (1e-9, False)):
        places = (pair.polycube + side * OUTWARD[axis]).T
        knots = pair.solid.knots
        at = [np.searchsorted(k, x) for k, x in zip(knots, places, strict=True)]
        assert (full[tuple(at)] == expected).all()


def test_without_shapes_and_deformation_the_geometry_is_the_polycube() -> None:
    for number in range(10):
        pair = LatticePairs(0, 128, PLAIN)(number)
        assert pair.geometry == pytest.approx(pair.polycube, abs=1e-12)
        assert pair.normals == pytest.approx(OUTWARD[pair.labels[:, 0]], abs=1e-9)


def test_styles_come_in_their_shares() -> None:
    options, rng = LatticeShapes(cad=0.5, organic=0.3), np.random.default_rng(0)
    styles = [options.style(rng) for _ in range(2000)]
    for style, share in (("cad", 0.5), ("organic", 0.3), ("both", 0.2)):
        assert styles.count(style) / 2000 == pytest.approx(share, abs=0.04)


def test_surfaces_are_closed_outward_and_hardly_flipped() -> None:
    """Area whose normal is more than 100 degrees off its axis: at most a sixtieth, in few parts."""
    still = replace(LatticeShapes().deformation, rotation=0.0)
    stream = LatticePairs(0, 1, replace(LatticeShapes(), deformation=still))
    turned = []
    for number in range(60):
        part = stream.part(number)
        assert volume(TriMesh(part.geometry, part.surface.faces)) > 0
        a, b, c = part.geometry[part.surface.faces].transpose(1, 0, 2)
        cross = np.cross(b - a, c - a)
        area = np.linalg.norm(cross, axis=1)
        along = np.einsum("fk,fk->f", cross, OUTWARD[part.surface.axis])
        turned.append(area[along < np.cos(np.radians(100)) * area].sum() / area.sum())
    assert max(turned) < 1 / 60
    assert np.mean(np.array(turned) > 1e-3) < 0.1
