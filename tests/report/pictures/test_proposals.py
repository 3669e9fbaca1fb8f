"""The sheet of proposals: each different polycube once, side by side."""

from dataclasses import replace

import numpy as np

from polycube.report.page import sections
from polycube.report.pictures import pictures, scenes
from polycube.report.pictures.render import view
from polycube.state import RunState
from polycube.testing.solids import solid
from polycube.types import Candidate, Ranked

BLOCK, HOLED = solid("cube").candidate, solid("hole_z").candidate


def ranked(candidate: Candidate, key: str) -> Ranked:
    blocks = solid("cube").hexes
    return Ranked(replace(candidate, key=key), 0.0, {}, blocks.hexes, blocks.vertices)


def ranking(n: int) -> list[Ranked]:
    return [ranked(BLOCK, f"key {k}") for k in range(n)]


def test_equal_structures_are_shown_once_and_blocks_that_are_no_polycube_never() -> None:
    first = [ranked(HOLED, "b"), ranked(BLOCK, "a")]
    others = [
        ranked(replace(HOLED, proposal="other"), "b"),
        ranked(replace(BLOCK, blocks=solid("cube").hexes), "c"),
    ]
    assert scenes.distinct([*first, *others]) == first
    assert len(scenes.distinct(ranking(20))) == scenes.MOST


def test_polycubes_of_equal_size_lie_in_rows_and_do_not_touch() -> None:
    shown = scenes.sheet(ranking(6))
    seen = [layer.points @ view().T for layer in shown]
    assert all(np.isclose(np.linalg.norm(np.ptp(layer.points, axis=0)), 1) for layer in shown)
    low, high = (np.array([end(p, axis=0)[:2] for p in seen]) for end in (np.min, np.max))
    for i in range(6):
        for j in range(i):
            assert (low[i] > high[j]).any() or (low[j] > high[i]).any()
    assert np.isclose(low[4, 0], low[0, 0]) and high[4, 1] < low[0, 1]  # below the first


def test_a_section_of_columns_is_shown_instead_of_the_polycube() -> None:
    run = solid("cube")
    swept = [ranked(replace(run.candidate, blocks=run.hexes), "c")]
    state = RunState(run.surface, ranked=swept, polycube=run.polycube, rough_map=run.rough_map)
    drawn = pictures.made(state)
    assert "section" in drawn and "polycube" not in drawn
    assert "foot of each column" in sections.structure(state, {}, {"section": b"\x89PNG"})


def test_a_run_with_two_structures_shows_them() -> None:
    surface = solid("cube").surface
    assert "proposals" not in pictures.made(RunState(surface, ranked=ranking(1)))
    drawn = ranked(replace(BLOCK, proposal="diffusion", probability=0.625), "drawn")
    state = RunState(surface, ranked=[*ranking(1), drawn])
    assert "proposals" in pictures.made(state)
    page = sections.structure(state, {}, {"proposals": b"\x89PNG"})
    assert f"1 {BLOCK.proposal}, 2 diffusion (62%)" in page
