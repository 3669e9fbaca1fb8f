"""Which grids structures are proposed on, and that the best grid is found."""

import numpy as np
import pytest

from polycube.config import compose
from polycube.errors import InputError
from polycube.pipeline.proposals import grids
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.state import RunState
from polycube.types import Candidate
from tests.conftest import first_quick
from tests.fixtures.polycubes import part

L = ("cube", "cube", "cube", None)
WITHOUT_WEIGHTS = ("~structure.proposals.diffusion", "mesh=example:rod")
TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])


SURFACE = part(L, TURN @ np.diag([20.0, 14, 9]), grid=(2, 2, 1))


def run(*overrides: str) -> Run:
    settings = Settings.of(compose("infer", [*WITHOUT_WEIGHTS, *overrides]))
    return Run(settings, lambda settings, clock: RunState(SURFACE))


def proposed(run: Run) -> tuple[Candidate, ...]:
    """Of all tiers, each of which is proposed once."""
    ranked = [entry for tier in run.proposals.tiers for entry in run.proposals(SURFACE, tier)]
    return tuple(entry.candidate for entry in ranked)


@pytest.mark.slow
def test_an_l_is_found_although_no_row_of_cells_has_its_shape():
    others = ("drawn", "sweep")
    state = run("grid=auto", *(f"~structure.proposals.{name}" for name in others)).begin()
    best, ranked = state.polycube, state.ranked
    assert sorted(best.grid) == [1, 2, 2] and best.occupancy.sum() == 3
    rows = [entry.score for entry in ranked if entry.candidate.polycube.grid[1:] == (1, 1)]
    assert ranked[0].score < 0.7 < 1.5 < min(rows)


@pytest.mark.parametrize(
    ("override", "expected"),
    first_quick(
        2,
        [
            ("seed=0", [(2, 1, 1), (3, 1, 1), (2, 2, 1)]),
            ("grid=2x2x2", [(2, 2, 2)]),
            ("grid.shape=[4,1,1]", [(4, 1, 1)]),
            ("grid.among=[[1,1,1],[5,1,1]]", [(1, 1, 1), (5, 1, 1)]),
        ],
    ),
)
def test_some_grids_are_tried_unless_one_is_given(override, expected):
    assert grids(run(override).settings) == expected


@pytest.mark.slow
def test_equal_structures_are_proposed_once():
    def among(*grids: str) -> Run:
        return run("~structure.proposals.drawn", "grid=auto", f"grid.among=[{','.join(grids)}]")

    twice = proposed(among("[2,1,1]", "[3,1,1]", "[2,1,1]"))
    once = proposed(among("[2,1,1]", "[3,1,1]"))
    assert [c.key for c in twice] == [c.key for c in once]
    on_two = {c.key for c in proposed(among("[2,1,1]"))}
    assert on_two & {c.key for c in proposed(among("[3,1,1]"))}  # the same boxes, read again
    assert not on_two & {c.key for c in once if c.polycube.grid == (3, 1, 1)}


@pytest.mark.parametrize(
    ("context", "grid"),
    first_quick(
        1,
        [
            ("[cube,cube]", (2, 1, 1)),
            ("[cube,cube,cube]", (3, 1, 1)),
            ("[cube,cube,cube,null]", (2, 2, 1)),
        ],
    ),
)
def test_a_given_context_goes_on_the_first_grid_that_holds_it(context, grid):
    found = run("grid=auto", f"context={context}")
    assert {c.polycube.grid for c in proposed(found)} == {grid}


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    first_quick(
        1,
        [
            (["structure=slices"], "structure=slices finds the structure itself"),
            (["structure.proposals.slices.frames=1"], "structure.proposals.slices.frames has no"),
            (["structure.proposals.labels.bricks=7"], "labels.bricks has no effect"),
        ],
    ),
)
def test_options_that_a_context_replaces_are_refused(overrides, sentence):
    one = ["~structure.proposals.diffusion"] if len(overrides[0]) > 20 else []
    cfg = compose("infer", [*one, "mesh=example:rod", "context=[cube,cube]", *overrides])
    made = Run(Settings.of(cfg), lambda settings, clock: RunState(SURFACE))
    with pytest.raises(InputError, match=sentence):
        made.begin()
