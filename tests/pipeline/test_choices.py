"""Which structures are meshed, and when no other is tried."""

from types import SimpleNamespace

import numpy as np
import pytest

from polycube.pipeline.choices import (
    NEARLY_BRICKS,
    can_be_better,
    choose,
    drawn_to_compare,
    is_unnecessary,
    structures_to_mesh,
    sufficient_jacobian,
)
from polycube.state import RunState
from polycube.plugins.acceptance.standard import Standard
from polycube.structure.lattice import collapse, lattice
from polycube.structure.rough_map import affine_map
from polycube.types import Candidate, Ranked
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.polycubes import PRIMITIVES, TWO, part

ACCEPTANCE = Standard()
FAMILY = {
    "slices": "grid",
    "diffusion": "grid",
    "boxes": "grid",
    "bricks": "lattice",
    "overlay": "overlay",
    "midpoint": "midpoint",
    "sweep": "sweep",
    "drawn": "drawn",
    "spare": "spare",
}


BLOCKS = hex_box((1, 1, 1))


def entry(proposal, key, score):
    return SimpleNamespace(
        candidate=SimpleNamespace(
            family=FAMILY[proposal],
            key=key,
            blocks=BLOCKS if proposal in ("midpoint", "sweep") else None,
            polycube=SimpleNamespace(occupancy=np.ones(ord(key))),
        ),
        score=score,
    )


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ([("slices", "a", 1), ("slices", "b", 2), ("bricks", "c", 3)], [0, 2, 1]),
        ([("bricks", "a", 1), ("bricks", "a", 1), ("diffusion", "b", 2)], [0, 2]),
        ([("slices", "a", 1), ("bricks", "c", 4.5), ("slices", "b", 4)], [0, 2]),
        ([*(("slices", key, 1) for key in "abcd"), ("overlay", "e", 1)], [0, 1, 2, 4]),
        ([("overlay", "a", np.inf), ("overlay", "b", np.inf)], [0, 1]),
        ([("midpoint", "m", 1), *(("slices", key, 1) for key in "abcd")], [0, 1, 2, 3]),
        ([*(("bricks", key, 1) for key in "abcd"), ("midpoint", "m", 1)], [0, 1, 2, 4]),
        ([("midpoint", "m", 1), ("overlay", "a", np.inf)], [0, 1]),
        ([("sweep", "s", 1), *(("slices", key, 1) for key in "abcd")], [0, 1, 2]),
        ([*(("bricks", key, 1) for key in "abcd"), ("sweep", "s", 1)], [0, 4, 1, 2]),
        ([("midpoint", "m", 1), ("bricks", "a", 1), ("sweep", "s", 1)], [0, 2, 1]),
        ([("drawn", "d", 1), *(("slices", key, 2) for key in "abcd")], [1, 2, 3]),
        ([("drawn", "d", 1), ("bricks", "a", 1), ("overlay", "o", np.inf)], [1, 2]),
        ([("drawn", key, 1) for key in "abcd"], [0, 1, 2]),
        ([("drawn", "d", 1), ("overlay", "o", np.inf), ("spare", "s", np.inf)], [0, 1]),
    ],
)
def test_after_the_best_the_best_of_the_other_family_is_tried(entries, expected):
    assert structures_to_mesh([entry(*e) for e in entries], tries=3) == expected


@pytest.mark.parametrize(
    ("proposal", "bricks", "reaches", "warnings", "expected"),
    [
        ("bricks", 8, 0.8, (), True),
        ("bricks", 8, 0.9, (), False),
        ("bricks", 8, 0.9, ("far",), True),
        ("bricks", 1, 0.65, (), False),  # excellent, and nothing is coarser
        ("bricks", 1, 0.55, (), True),
        ("drawn", 8, 0.8, (), False),
        (None, 8, 0.8, (), False),  # a hex mesh to improve
    ],
)
def test_a_drawn_structure_may_be_better(proposal, bricks, reaches, warnings, expected):
    start = SimpleNamespace(
        ranked=[entry(proposal, "a", 1)] if proposal else [],
        chosen=0,
        polycube=SimpleNamespace(occupancy=np.ones((bricks, 1, 1), bool)),
    )
    taken = SimpleNamespace(verdict=SimpleNamespace(warnings=warnings))
    found = SimpleNamespace(start=start, reaches=reaches, taken=lambda: taken)
    assert can_be_better(found, ACCEPTANCE) == expected


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ([("bricks", "a", 1), ("drawn", "a", 1), ("drawn", "b", 1)], 1),
        ([("bricks", "a", 1), ("drawn", "e", 2), ("drawn", "d", 2.2)], 2),
        ([("bricks", "a", 1), ("drawn", "e", 2), ("drawn", "d", 2.4)], 1),
        ([("bricks", "a", 1), ("drawn", "d", 5)], None),  # its score is too bad
        ([("bricks", "a", 1)], None),
    ],
)
def test_a_drawn_structure_is_meshed_beside_the_one_found(entries, expected):
    ranked = [entry(*e) for e in entries]
    assert drawn_to_compare(ranked) == expected


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ([("slices", 5.0), ("bricks", 5.6)], ACCEPTANCE.excellent),
        ([("slices", 5.0), ("bricks", 5.8)], ACCEPTANCE.acceptable),
        ([("slices", 5.0), ("diffusion", 5.1)], ACCEPTANCE.acceptable),
        ([("bricks", 5.0)], ACCEPTANCE.acceptable),
        ([("bricks", 5.0), ("overlay", np.inf)], ACCEPTANCE.acceptable),
        ([("bricks", 5.0), ("sweep", 9.0)], np.inf),
        ([("sweep", 5.0), ("bricks", 9.0), ("overlay", np.inf)], NEARLY_BRICKS),
        ([("sweep", 5.0), ("overlay", np.inf)], ACCEPTANCE.acceptable),
    ],
)
def test_a_close_rival_of_the_other_family_is_tried_unless_the_mesh_is_perfect(entries, expected):
    ranked = [
        SimpleNamespace(candidate=SimpleNamespace(family=FAMILY[p]), score=s) for p, s in entries
    ]
    choices = list(range(len(ranked)))
    assert sufficient_jacobian(ranked, choices, 0, ACCEPTANCE) == expected
    assert (
        sufficient_jacobian(ranked, choices, len(ranked) - 1, ACCEPTANCE) == ACCEPTANCE.acceptable
    )


def test_the_state_has_the_denoising_of_the_structure_that_is_chosen():
    polycube = collapse(lattice(TWO, ("cube", "hole_y"), PRIMITIVES))
    surface = part(("cube", "hole_y"), np.eye(3))
    rough_map = affine_map(polycube, np.eye(3), np.zeros(3))
    states = np.random.default_rng(0).uniform(size=(3, 20, 3))
    plain = Candidate("slices", polycube, rough_map, 0.0, "one")
    other = Candidate("slices", polycube, rough_map, 0.0, "other")
    denoised = Candidate("diffusion", polycube, rough_map, 0.0, "one", states, steps=(9, 4, 0))
    hexes = hex_box()
    ranked = [Ranked(c, 1.0, {}, hexes, hexes.vertices) for c in (plain, other, denoised)]
    first = choose(RunState(surface, ranked=ranked), 0, PRIMITIVES)
    assert first.trajectory is states and first.steps == (9, 4, 0)
    assert first.polycube is polycube and len(first.parametrization.positions) == len(
        surface.vertices
    )
    second = choose(first, 1, PRIMITIVES)
    assert second.chosen == 1 and second.trajectory is None and second.steps == ()


@pytest.mark.parametrize(
    ("made", "is_cad", "expected"),
    [
        ([], True, False),
        ([("labels", 0.3, 0)], True, True),
        ([("labels", 0.29, 0)], True, False),
        ([("labels", 0.29, 0)], False, True),
        ([("labels", -np.inf, 0)], True, False),  # a poor hex
        ([("labels", -np.inf, 0)], False, True),
        ([("labels", -np.inf, 0), ("overlay", -np.inf, 0)], True, False),
        ([("labels", -np.inf, 0), ("overlay", -np.inf, 2)], True, False),
        ([("labels", 0.3, 0), ("overlay", -np.inf, 2)], True, True),
    ],
)
def test_an_overlay_is_for_meshes_that_miss_something(made, is_cad, expected):
    def entry(family):
        return SimpleNamespace(candidate=SimpleNamespace(family=family))

    def variants(family, reaches, lost):
        verdict = SimpleNamespace(is_valid=True, lost=lost, reaches=reaches)
        taken = SimpleNamespace(verdict=verdict)
        return SimpleNamespace(
            start=SimpleNamespace(
                ranked=[entry(family)], chosen=0, surface=SimpleNamespace(region=[1] * is_cad)
            ),
            attempts={(0, False): taken},
            best=(-lost, reaches),
            taken=lambda: taken,
        )

    before = [variants(*each) for each in made]
    assert is_unnecessary(entry("overlay"), before) == expected
    assert not is_unnecessary(entry("labels"), before)
