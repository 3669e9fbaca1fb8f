"""Lattices of bricks: knots, labels and topology by exhaustive search, then full parts."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.plugins.structure.bricks.cut import minimum_cut
from polycube.plugins.structure.bricks.knots import hole_knots, segment_costs, segmentations
from polycube.plugins.structure.bricks.topology import corners, defect, repaired
from polycube.registry import build
from polycube.structure.lattice import boundary, collapse, genus, is_manifold, lattice
from polycube.structure.lattice import corners as lattice_corners
from polycube.structure.rough_map import evaluate
from polycube.surface.frames import rotations, turn
from polycube.types import Candidate, Polycube
from tests.fixtures.polycubes import PRIMITIVES, part

TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix() @ np.diag([20.0, 15.0, 11.0])


def polycube(full: np.ndarray) -> Polycube:
    return Polycube(full, *(np.arange(n + 1) for n in full.shape), (1, 1, 1), ("cube",))


@pytest.mark.parametrize(
    ("wanted", "held", "lengths"),
    [((), set(), [2, 3, 4, 5]), ((4, 9, 5), {4}, [3, 4, 5, 6]), ((3, 7), {3, 7}, [4, 5])],
)
def test_segmentation_of_the_slices_is_optimal(wanted, held, lengths):
    """Exhaustive search over all divisions of ten noisy slices that contain the fixed knots."""
    rng = np.random.default_rng(0)
    solid = np.repeat(rng.random((3, 4, 5)) < 0.5, [3, 4, 3], axis=0) ^ (
        rng.random((10, 4, 5)) < 0.1
    )

    def cost(cut: np.ndarray) -> int:
        pieces = [solid[a:b] for a, b in itertools.pairwise(cut)]
        return sum(int(np.minimum(p.sum(0), len(p) - p.sum(0)).sum()) for p in pieces)

    found = segmentations(segment_costs(solid), 4, 2, wanted)
    assert [len(cut) for cut in found] == lengths
    for cut in found:
        inner = itertools.combinations(range(1, 10), len(cut) - 2)
        every = [np.array([0, *knots, 10]) for knots in inner if held <= set(knots)]
        assert np.diff(cut).min() >= 2
        assert held <= set(cut)
        assert cost(cut) == min(cost(c) for c in every if np.diff(c).min() >= 2)
    at = lengths.index(4)
    np.testing.assert_array_equal(found[at], [0, 4, 7, 10] if 4 in held else [0, 3, 7, 10])


def test_a_hole_gets_its_knots():
    solid = np.ones((12, 10, 6), bool)
    solid[3:7, 4:6] = False
    sides, ends = hole_knots(solid, 2)
    assert [list(knots) for knots in sides] == [[3, 7], [4, 6], []]
    assert [list(knots) for knots in ends] == [[], [], [0, 6]]
    sides, ends = hole_knots(solid, 7)
    assert not any(len(knots) for knots in sides + ends)


def test_other_knots_are_chosen_with_those_of_a_hole():
    """A roof over a bore: without fixed knots at the ends of the bore, the step gets a knot."""
    solid = np.zeros((20, 10), bool)
    solid[:, :4] = True  # a wall as high as the part,
    solid[6:14, 1:3] = False  # with a bore,
    solid[:10, 4:] = True  # and a block beside it that ends half-way up the bore
    costs = segment_costs(solid)
    assert [list(cut) for cut in segmentations(costs, 2, 2, (6, 14))][1] == [0, 6, 10, 14, 20]


def energy(full, gain, areas) -> float:
    faces = [np.diff(np.pad(full, 1).astype(int), axis=axis) != 0 for axis in range(3)]
    inside = (faces[0][:, 1:-1, 1:-1], faces[1][1:-1, :, 1:-1], faces[2][1:-1, 1:-1, :])
    return -gain[full].sum() + sum((a * f).sum() for a, f in zip(areas, inside, strict=True))


def random_energies(rng, shape):
    gain = rng.normal(size=shape)
    return gain, tuple(rng.random(np.array(shape) + np.eye(3, dtype=int)[a]) / 2 for a in range(3))


@pytest.mark.parametrize("seed", range(4))
def test_minimum_cut_is_optimal(seed):
    """Exhaustive search over all labels of twelve bricks."""
    shape = (2, 3, 2)
    gain, areas = random_energies(np.random.default_rng(seed), shape)
    every = [np.array(bits, bool).reshape(shape) for bits in itertools.product([0, 1], repeat=12)]
    least = min(energy(full, gain, areas) for full in every)
    assert energy(minimum_cut(gain, areas), gain, areas) == pytest.approx(least, abs=0.01)


def test_the_defect_is_zero_for_a_manifold_of_the_genus_only():
    rng, right = np.random.default_rng(0), 0
    for _ in range(600):
        full = rng.random(rng.integers(1, 4, 3)) < rng.choice([0.5, 0.8, 0.9])
        if not full.any():
            continue
        solid, wanted = polycube(full), int(rng.integers(0, 2))
        expected = is_manifold(solid) and genus(solid) == wanted
        assert (defect(full, wanted) == 0) == expected
        right += expected
        if expected:
            assert corners(full) == len(lattice_corners(boundary(solid)))
    assert right > 50


@pytest.mark.parametrize("wanted", [0, 1, 3])
def test_repair_reaches_the_genus_and_then_a_minimum(wanted):
    rng, n_mended = np.random.default_rng(wanted), 0
    for _ in range(10):
        gain, areas = random_energies(rng, (5, 4, 5))
        found = repaired(minimum_cut(gain, areas), gain, areas, wanted)
        if found is None:
            continue
        n_mended += 1
        assert is_manifold(polycube(found)) and genus(polycube(found)) == wanted
        for brick in np.ndindex(found.shape):
            other = found.copy()
            other[brick] ^= True
            if defect(other, wanted) == 0:
                assert energy(other, gain, areas) > energy(found, gain, areas) - 1e-9
    assert n_mended >= 6


def propose(surface, **options) -> list[Candidate]:
    config = {"plugin": "bricks", **options}
    return build("structure", config, grid=(1, 1, 1), primitives=PRIMITIVES)(surface, ())


def shapes(solid: Polycube) -> set:
    turned = [turn(collapse(solid).occupancy, rotation) for rotation in rotations()]
    return {(boxes.shape, boxes.tobytes()) for boxes in turned}


@pytest.mark.parametrize(
    ("grid", "context"),
    [
        ((2, 2, 1), ("cube", "cube", "cube", None)),
        ((3, 2, 1), ("cube", "cube", "cube", None, "cube", "cube")),
        ((2, 2, 2), ("cube", "cube", "cube", None, "cube", None, None, None)),
        ((3, 1, 1), ("hole_y", "hole_y", "hole_y")),
        ((3, 2, 1), ("hole_z", "hole_z", "hole_z", "hole_z", "cube", None)),
        ((2, 1, 1), ("hole_x", "hole_y")),
        ((2, 2, 1), ("hole_z", "hole_x", "hole_y", None)),
    ],
)
def test_a_polycube_of_any_grid_and_genus_is_found(grid, context):
    surface = part(context, TURNED, grid=grid)
    best = propose(surface)[0]
    true = lattice(grid, context, PRIMITIVES)
    assert shapes(best.polycube) == shapes(true)
    corners = boundary(collapse(true)).vertices @ TURNED.T
    found = evaluate(best.rough_map, boundary(best.polycube).vertices)
    gap = np.linalg.norm(found[:, None] - corners, axis=2)
    assert max(gap.min(axis=0).max(), gap.min(axis=1).max()) < 0.05 * np.ptp(corners, 0).max()


def test_candidates_differ_and_need_a_full_primitive():
    surface = part(("cube", "hole_y"), TURNED)
    found = propose(surface)
    assert len({(c.polycube.occupancy.shape, c.key) for c in found}) == len(found)
    config = {"plugin": "bricks"}
    holes = {"hole_x": PRIMITIVES["hole_x"]}
    assert build("structure", config, grid=(1, 1, 1), primitives=holes)(surface, ()) == []
