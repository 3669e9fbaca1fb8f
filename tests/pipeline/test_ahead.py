"""Results made ahead on other threads: the same as without, and in the same order."""

import logging
import time
from dataclasses import dataclass
from threading import Event, Thread

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import MeshingError
from polycube.numerics.lbfgs import Stopped, descend
from polycube.pipeline import ahead
from polycube.pipeline.ahead import Ahead, Memo
from polycube.pipeline.portfolio import Portfolio, run_portfolio, search
from polycube.pipeline.stages import Clock, Stage
from polycube.types import HexMesh, TriMesh
from tests.pipeline.test_pipeline import cube


def valley(x):
    return float(x @ x), 2 * x


def test_a_memo_makes_each_result_once_and_others_wait_for_it():
    memo, calls, begun, go = Memo(), [], Event(), Event()

    def slow():
        begun.set()
        calls.append(1)
        go.wait(10)
        return "slow"

    thread = Thread(target=memo.get, args=("key", slow))
    thread.start()
    assert begun.wait(10)
    Thread(target=go.set).start()
    assert memo.get("key", lambda: pytest.fail("made twice")) == ("slow", [])
    thread.join()
    assert memo.get("other", lambda: "quick")[0] == "quick" and calls == [1]


def test_what_was_stopped_is_made_again(monkeypatch):
    monkeypatch.setattr(ahead, "cores", lambda: 2)
    memo, begun, halted = Memo(), Event(), Event()

    def endless():
        begun.set()
        try:
            while True:
                descend(valley, np.ones(3), 5)
        finally:
            halted.set()

    with Ahead() as beside:
        beside.begin([lambda: memo.get("key", endless)])
        assert begun.wait(10)
        beside.drop()
        assert memo.get("key", lambda: "made here") == ("made here", [])
        assert halted.wait(10)
        done = Event()
        beside.begin([done.set])  # later jobs are not stopped
        assert done.wait(10)


def test_on_one_core_jobs_are_not_even_looked_at(monkeypatch):
    monkeypatch.setattr(ahead, "cores", lambda: 1)
    with Ahead() as beside:
        beside.begin(pytest.fail("looked at") for _ in range(3))


def test_a_descent_that_nobody_wants_is_stopped():
    stop = Event()
    with ahead.stoppable(stop):
        assert abs(descend(valley, np.ones(3), 50)).max() < 1e-3
        stop.set()
        with pytest.raises(Stopped):
            descend(valley, np.ones(3), 50)
    assert abs(descend(valley, np.ones(3), 50)).max() < 1e-3


@dataclass(frozen=True)
class Grow:
    """A size after some work: less of it in a short run; none above 90."""

    to: float = 1.0
    short: bool = False

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        descend(valley, np.full(3, self.to), 5)
        logging.getLogger("polycube").info("grown to %g", self.to)
        if self.to > 90:
            raise MeshingError(f"{self.to} is too large")
        return cube(self.to / (2 if self.short else 1))


class Lines(logging.Handler):
    """Keeps what is logged, without the times."""

    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage().partition("  ")[0])


def searched(cores, starts, enough, has_rival):
    """Size, scores, effort and log of a search on so many cores."""
    log, lines, clock = logging.getLogger("polycube"), Lines(), Clock()

    def portfolios():
        for number, sizes in enumerate(starts):
            log.info("start %d", number)
            variants = [{"meshing/optimize": {"to": to}} for to in sizes]
            state = {"surface": None, "hexes": cube()}
            yield Portfolio(
                [Stage("meshing/optimize", Grow())],
                variants,
                state,
                clock,
                lambda end: end["hexes"].vertices.max(),
                {"meshing/optimize": {"short": True}},
            )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ahead, "cores", lambda: cores)
        level = log.level
        log.setLevel(logging.INFO)
        log.addHandler(lines)
        try:
            found = search(portfolios(), enough, lambda tried: tried.best > 40, has_rival)
        finally:
            log.removeHandler(lines)
            log.setLevel(level)
    assert not lines.filters
    return found.best, found.scores, clock.effort, lines.lines


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.lists(st.floats(1, 100), min_size=1, max_size=4), min_size=1, max_size=3),
    st.floats(1, 100),
    st.booleans(),
)
def test_a_search_finds_and_says_the_same_on_any_number_of_cores(starts, enough, has_rival):
    alone = searched(1, starts, enough, has_rival)
    assert all(searched(cores, starts, enough, has_rival) == alone for cores in (2, 4))


def test_the_clock_counts_time_as_it_passed(monkeypatch):
    monkeypatch.setattr(ahead, "cores", lambda: 2)
    ready = Event()

    @dataclass(frozen=True)
    class Wait:
        first: bool = True

        def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
            if self.first:
                assert ready.wait(10)  # the other variant is made meanwhile
            else:
                Event().wait(0.21)
                ready.set()
            return cube(1.0 if self.first else 2.0)

    clock = Clock()
    state = {"surface": None, "hexes": cube()}
    variants = [{}, {"meshing/optimize": {"first": False}}]
    begin = time.perf_counter()
    end, _ = run_portfolio(
        [Stage("meshing/optimize", Wait())],
        variants,
        state,
        clock,
        lambda s: s["hexes"].vertices.max(),
    )
    assert end["hexes"].vertices.max() == 2
    # both took .2 s, at the same time
    assert 0.2 <= clock.seconds["meshing/optimize"] <= time.perf_counter() - begin
