"""What CAD gives parts: round sections, also where others cross them; slants; draft; widths."""

from dataclasses import fields

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import smoothed, tessellate
from polycube.diffusion.pairs.cad_shapes import CadShapes, with_round_section
from polycube.diffusion.pairs.lattices import (
    LEAST,
    SHRINKS,
    Feature,
    Lattice,
    random_knots,
    random_lattice,
)
from polycube.diffusion.pairs.rounding import FILLET, Fillets, edge_runs, rounded

OFF = {field.name: 0.0 for field in fields(CadShapes)}
HOLE = Feature("hole", (1, 1, 0), (2, 2, 3), 2)
PLATE = np.ones((3, 3, 3), bool)
PLATE[1, 1] = False
KNOTS = 3 * (np.array([-1, -0.25, 0.25, 1.0]),)


def sharp(occupancy: np.ndarray) -> Fillets:
    edges = edge_runs(occupancy, KNOTS)
    return Fillets(edges, np.zeros(len(edges.axis)), np.full(len(edges.axis), FILLET))


@pytest.mark.parametrize("is_crossed", [False, True])
def test_a_round_hole_is_round_also_where_another_crosses_it(is_crossed: bool) -> None:
    occupancy = PLATE.copy()
    occupancy[:, 1, 1] &= not is_crossed
    found = tessellate(occupancy, KNOTS)
    x = rounded(found.vertices, with_round_section(sharp(occupancy), HOLE, KNOTS))
    on_wall = (found.axis < 4) & np.isin(found.knot, (1, 2))
    middle = np.abs(found.vertices[found.faces].mean(axis=1))
    on_wall &= (middle[:, :2] < 0.251).all(axis=1)  # not of the hole that crosses
    wall = np.unique(found.faces[on_wall])
    assert np.hypot(*x[wall, :2].T) == pytest.approx(0.25, abs=1e-12)
    assert np.array_equal(x[:, 2], found.vertices[:, 2])


def test_an_open_section_keeps_its_mouth() -> None:
    """A slot open towards +x: its two inner edges are round, the mouth is as it was."""
    occupancy = np.ones((3, 3, 3), bool)
    occupancy[1:, 1] = False
    slot = Feature("slot", (1, 1, 0), (3, 2, 3), 2)
    found = tessellate(occupancy, KNOTS)
    x = rounded(found.vertices, with_round_section(sharp(occupancy), slot, KNOTS))
    end = np.unique(found.faces[(found.axis == 0) & (found.knot == 1)])
    assert np.hypot(*x[end, :2].T) == pytest.approx(0.25, abs=1e-12)
    mouth = found.vertices[:, 0] == 1
    assert np.array_equal(x[mouth], found.vertices[mouth])


def test_a_hole_through_two_flanges_is_round_in_both() -> None:
    """And its web, which closes the gap on one side, is where it was but near the flanges."""
    z = np.array([-1, -0.75, -0.25, 0.25, 0.75, 1.0])
    occupancy = np.ones((3, 3, 5), bool)
    occupancy[1, 1] = occupancy[1:, :, 1:4] = False
    knots = (KNOTS[0], KNOTS[1], z)
    edges = edge_runs(occupancy, knots)
    fillets = Fillets(edges, np.zeros(len(edges.axis)), np.full(len(edges.axis), FILLET))
    hole = Feature("hole", (1, 1, 0), (2, 2, 5), 2)
    found = tessellate(occupancy, knots)
    before, x = found.vertices, rounded(found.vertices, with_round_section(fillets, hole, knots))
    in_flange = np.abs(before[:, 2]) >= 0.75
    wall = in_flange & (np.abs(before[:, :2]).max(axis=1) == 0.25)
    assert wall.sum() > 50
    assert np.hypot(*x[wall, :2].T) == pytest.approx(0.25, abs=1e-12)
    far = np.abs(before[:, 2]) <= 0.5
    assert far.any() and np.array_equal(x[far], before[far])


def test_a_section_of_which_no_edge_is_whole_stays() -> None:
    occupancy = PLATE.copy()
    occupancy[0, :, :2] = False
    occupancy[2, :, 2:] = False
    assert with_round_section(sharp(occupancy), HOLE, KNOTS).radius.max() == 0


@pytest.mark.parametrize("seed", range(10))
def test_slanted_planes_are_planes_in_their_order(seed: int) -> None:
    lattice = random_lattice(np.random.default_rng(seed))
    shapes = CadShapes(**OFF | {"slants": 1.0, "slant": 0.45})
    knots = random_knots(lattice, [], np.random.default_rng(seed))
    found = tessellate(lattice.occupancy, knots)
    before = found.vertices
    x = shapes.shaped(before, lattice, knots, [], np.random.default_rng(seed))
    assert not np.array_equal(x, before)
    for axis, each in enumerate(knots):
        others = np.column_stack([np.ones(len(before)), np.delete(before, axis, axis=1)])
        planes = []
        for knot in each:
            own = before[:, axis] == knot
            plane = np.linalg.lstsq(others[own], x[own, axis], rcond=None)[0]
            assert others[own] @ plane == pytest.approx(x[own, axis], abs=1e-12)
            planes.append(others @ plane)
        assert (np.diff(planes, axis=0) > 0).all()


def test_draft_scales_sections_from_end_to_end() -> None:
    shapes = CadShapes(**OFF | {"drafts": 1.0, "draft": 0.1})
    block = Lattice(np.ones((1, 1, 1), bool), [], 0)
    knots = (np.array([-1.0, 1]), np.array([-1.0, 1]), np.array([-0.5, 0.5]))
    found = tessellate(block.occupancy, knots)
    x = shapes.shaped(found.vertices, block, knots, [], np.random.default_rng(1))
    widths = [np.ptp(x[found.vertices[:, 2] == z, 0]) for z in (-0.5, 0.5)]
    assert sum(widths) == pytest.approx(4)
    assert 0 < abs(widths[0] - widths[1]) <= 4 * 0.1


@pytest.mark.parametrize("seed", range(20))
def test_widths_are_no_slivers_and_sections_are_square(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lattice = random_lattice(rng)
    square = [each for each in lattice.features if each.kind == "hole"][:1]
    knots = random_knots(lattice, square, rng)
    assert max(each[-1] for each in knots) == pytest.approx(1)
    assert min(np.diff(each).min() for each in knots) > LEAST * SHRINKS
    for feature in square:
        sides = [
            knots[a][feature.high[a]] - knots[a][feature.low[a]]
            for a in range(3)
            if a != feature.axis
        ]
        ratio = sides[0] / sides[1]
        assert ratio == pytest.approx(1, abs=1e-9) or not 0.5 < ratio < 2
    for axis, each in enumerate(knots):
        if not square and np.array_equal(lattice.occupancy, np.flip(lattice.occupancy, axis)):
            assert each == pytest.approx(-each[::-1])


def test_smoothing_goes_half_way_to_the_mean_of_the_neighbours() -> None:
    """Against a loop over all vertices; in the box of before."""
    vertices, quads = tessellate(PLATE, KNOTS, pieces=2)[:2]
    ends = np.concatenate([quads[:, [i, (i + 1) % 4]] for i in range(4)])
    slow = vertices.copy()
    for v in range(len(vertices)):
        near = np.setdiff1d(ends[(ends == v).any(axis=1)], v)
        weights = 1 / np.linalg.norm(vertices[near] - vertices[v], axis=1)
        slow[v] = (vertices[v] + weights @ vertices[near] / weights.sum()) / 2
    slow /= slow.max(axis=0)
    assert smoothed(vertices, quads, 1) == pytest.approx(slow, abs=1e-12)
    assert smoothed(vertices, quads, 0) == pytest.approx(vertices, abs=1e-12)
    corner = (np.abs(vertices) == 1).all(axis=1)
    assert np.linalg.norm(smoothed(vertices, quads, 20)[corner], axis=1).max() < 1.5
