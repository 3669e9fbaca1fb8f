"""Slab patterns, slice measures and the dynamic programme, on cases with a known result."""

import itertools
from collections import Counter

import numpy as np
import pytest

from polycube.plugins.structure.slices.alignment import (
    Alignment,
    Costs,
    View,
    align,
    cut,
    emissions,
    slab_patterns,
    slabs_of_context,
)
from polycube.plugins.structure.slices.candidates import misfit, place
from polycube.plugins.structure.slices.sections import measure
from polycube.structure.lattice import genus
from polycube.surface.voxels import Voxels
from tests.fixtures.polycubes import PRIMITIVES, TWO

BOXES = {
    "F": [(2, 14, 2, 14)],
    "R": [(2, 14, 2, 6), (2, 14, 10, 14), (2, 6, 6, 10), (10, 14, 6, 10)],
    "Y": [(2, 14, 2, 6), (2, 14, 10, 14)],
    "Z": [(2, 6, 2, 14), (10, 14, 2, 14)],
}


def section(*boxes) -> np.ndarray:
    image = np.zeros((16, 16), bool)
    for y0, y1, z0, z1 in boxes:
        image[y0:y1, z0:z1] = True
    return image


def solid(slabs: str) -> np.ndarray:
    """(X, 16, 16) voxels, one slice per slab between two empty ones; "." is an empty slice."""
    return np.stack([section(*BOXES.get(slab, [])) for slab in f".{slabs}."])


def test_two_cells_have_fourteen_patterns_of_genus_0_1_2():
    found = slab_patterns(TWO, PRIMITIVES)
    assert len(found) == 14
    assert Counter(genus(p.polycubes[0]) for p in found) == {0: 3, 1: 7, 2: 4}
    assert {p.slabs for p in found[:3]} == {"F", "R", "FR"}
    assert sum(len(p.polycubes) for p in found) == 4 + 16
    assert {p.slabs: p.without_ring() for p in found}["RFYF"] == {"FYF"}
    assert len(slab_patterns((3, 1, 1), PRIMITIVES)) == 33  # nine more enclose a void


def test_equal_slabs_are_merged_and_unknown_slabs_have_no_pattern():
    assert slabs_of_context(("cube", "hole_y"), PRIMITIVES) == "FYF"
    assert slabs_of_context(("hole_x", "hole_z", None), PRIMITIVES) == "RFZF"
    corner = np.ones((3, 3, 3), bool)
    corner[0, 0, 0] = False
    more = {**PRIMITIVES, "corner": corner}
    assert slabs_of_context(("cube", "corner"), more) == ""
    with_corner, without = slab_patterns(TWO, more), slab_patterns(TWO, PRIMITIVES)
    assert [p.slabs for p in with_corner] == [p.slabs for p in without]


def test_measures_of_a_ring_two_bars_and_a_channel():
    channel = section((2, 14, 2, 14), (0, 0, 0, 0))
    channel[6:10, 6:] = False  # open to high z, solid on both sides in y
    found = measure(np.stack([*solid("RYF"), channel]))
    ring, bars, full, cut_open = 1, 2, 3, 5
    np.testing.assert_array_equal(
        found.area[[0, ring, bars, full, cut_open]], [0, 128, 96, 144, 112]
    )
    assert found.hole_area[ring] == found.hole_total[ring] == 16
    np.testing.assert_array_equal(found.hole_box[ring], [6, 10, 6, 10])
    assert found.hole_area[[0, bars, full, cut_open]].tolist() == [0, 0, 0, 0]
    np.testing.assert_array_equal(found.piece_area[bars], [48, 48])
    np.testing.assert_array_equal(found.piece_box[bars], [[2, 14, 2, 6], [2, 14, 10, 14]])
    assert found.piece_area[full].tolist() == [144, 0]
    np.testing.assert_array_equal(found.between[bars], [0, 48, 48])
    np.testing.assert_array_equal(found.between[cut_open], [32, 0, 32])
    assert found.gain[bars, 1] == 24  # half of the gap: removing 4 empty z rows
    assert found.gain[cut_open, 0] == 0.5 * 32 - 16  # 4 y rows hold 16 of the solid
    assert (found.span[[ring, bars, full]] == 12).all() and (found.span[0] == 0).all()


def test_each_slab_is_cheapest_for_its_own_section():
    cost = emissions(measure(solid("FRYZ")), Costs())
    for index, slab in enumerate("FRYZ", start=1):
        values = {name: c[index] for name, c in cost.items()}
        assert min(values, key=values.get) == slab
        assert values[slab] == pytest.approx(0)
        assert min(v for name, v in values.items() if name != slab) > 0.05 * 96
    assert all(c[0] == 0 for c in cost.values())


def test_a_u_section_is_two_bars_rather_than_full():
    u_shape = section((2, 14, 2, 4), (2, 14, 12, 14), (2, 4, 2, 14))
    cost = emissions(measure(np.stack([section(), u_shape])), Costs())
    assert cost["Y"][1] < min(cost["F"][1], cost["R"][1], cost["Z"][1])


@pytest.mark.parametrize("slabs", ["F", "FY", "FYF", "RFR", "FYFR"])
@pytest.mark.parametrize("seed", range(3))
def test_the_cut_is_the_best_of_all(slabs, seed):
    n, shortest = 9, 2
    emission = dict(zip("FRY", np.random.default_rng(seed).random((3, n)), strict=True))
    least = [
        1 if c == "F" and i in (0, len(slabs) - 1) and len(slabs) > 1 else shortest
        for i, c in enumerate(slabs)
    ]
    best = np.inf
    for inner in itertools.combinations(range(1, n), len(slabs) - 1):
        bounds = [0, *inner, n]
        if all(b - a >= m for a, b, m in zip(bounds, bounds[1:], least, strict=False)):
            parts = zip(slabs, bounds, bounds[1:], strict=False)
            best = min(best, sum(emission[c][a:b].sum() for c, a, b in parts))
    cost, bounds = cut(slabs, emission, shortest)
    assert cost == pytest.approx(best)
    parts = zip(slabs, bounds, bounds[1:], strict=False)
    assert cost == pytest.approx(sum(emission[c][a:b].sum() for c, a, b in parts))


def test_too_few_slices_cannot_be_cut():
    assert cut("FYFYF", {c: np.zeros(4) for c in "FY"}, 2)[0] == np.inf


def alignments(slabs: str) -> list[Alignment]:
    view = View(np.eye(3), np.eye(3), Voxels(solid(slabs), np.zeros(3), 1.0))
    return sorted(align(view, slab_patterns(TWO, PRIMITIVES), Costs()), key=lambda a: a.cost)


@pytest.mark.parametrize("phases", [(5,), (3, 4), (3, 5, 2), (3, 4, 5, 4, 3)])
def test_a_solid_is_aligned_with_its_own_pattern(phases):
    slabs = "".join(c * n for c, n in zip("FYFZF", phases, strict=False))
    if len(phases) == 2:
        slabs = slabs.replace("Y", "R")
    best = alignments(slabs)[0]
    assert best.pattern.slabs == "".join(c for c, _ in itertools.groupby(slabs))
    np.testing.assert_array_equal(best.bounds, 1 + np.append(0, np.cumsum(phases)))


def test_empty_voxels_have_no_alignment():
    assert alignments("....") == []


def test_a_pattern_with_a_missing_hole_is_still_placed_on_the_part():
    ring = next(r for r in alignments("F" * 9) if r.pattern.slabs == "R")
    placed = place(ring, ring.pattern.polycubes[0]).positions
    np.testing.assert_allclose(placed.min(axis=(0, 1, 2)), [1, 2, 2])
    np.testing.assert_allclose(placed.max(axis=(0, 1, 2)), [10, 14, 14])


def test_a_shallow_dent_is_no_blind_hole():
    assert alignments("R" + "F" * 60)[0].pattern.slabs == "F"
    assert "FR" not in {r.pattern.slabs for r in alignments("R" + "F" * 60)}
    assert alignments("R" * 20 + "F" * 40)[0].pattern.slabs == "RF"


def test_lengths_choose_among_contexts_of_a_pattern():
    best = alignments("F" * 16 + "Y" * 4 + "F" * 4)[
        0
    ]  # section 12: two cells, the hole in the second
    named = min(best.pattern.polycubes, key=lambda polycube: misfit(best, polycube))
    assert named.context == ("cube", "hole_y")
