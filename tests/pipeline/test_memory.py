"""The memory of the analysis is estimated before it begins."""

import logging
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from polycube.numerics import memory
from polycube.pipeline.resume.results import StageResults
from polycube.pipeline.run import Run
from polycube.search.chain import Deadline
from polycube.stages import Clock, Stage
from polycube.state import RunState

GIGA = 1_000_000_000


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Sets what the system says: bytes available, limit and use of the container."""

    def set_to(free: int | None, limit: str | None = None, used: int = 0) -> None:
        monkeypatch.setattr(memory, "MEMINFO", tmp_path / "meminfo")
        monkeypatch.setattr(memory, "GROUP", tmp_path)
        if free is not None:
            text = f"MemTotal: 99 kB\nMemAvailable:   {free // 1024} kB\n"
            (tmp_path / "meminfo").write_text(text)
        if limit is not None:
            (tmp_path / "memory.max").write_text(f"{limit}\n")
            (tmp_path / "memory.current").write_text(f"{used}\n")

    return set_to


def test_the_smaller_of_machine_and_container_counts(machine) -> None:
    machine(None)
    assert memory.available() is None
    machine(1024_000)
    assert memory.available() == 1024_000
    machine(1024_000, "max", 5)
    assert memory.available() == 1024_000
    machine(1024_000, "3000", 1000)
    assert memory.available() == 2000
    machine(1024_000, "3000", 4000)
    assert memory.available() == 0


@pytest.mark.parametrize(
    ("functions", "measured"), [(50_653, 3.2), (148_877, 9.8), (155_340, 11.3)]
)
def test_the_estimate_is_near_what_was_measured(functions: int, measured: float) -> None:
    assert memory.needed(functions) == pytest.approx(measured * GIGA, rel=0.12)


@pytest.mark.parametrize(("functions", "measured"), [(7_208, 0.64), (13_188, 1.52), (50_000, 10.0)])
def test_a_factor_needs_more(functions: int, measured: float) -> None:
    assert memory.needed(functions, is_factored=True) == pytest.approx(measured * GIGA, rel=0.05)


def test_one_sentence_where_the_memory_is_too_small(machine, caplog) -> None:
    machine(8 * GIGA)
    with caplog.at_level(logging.WARNING):
        memory.warn(100_000)
        assert not caplog.messages
        memory.warn(148_877)
    assert caplog.messages == [
        "warning: the analysis of 148877 functions needs about 10 GB of memory, and 8 GB are "
        "available; a larger meshing.size needs less"
    ]


def test_the_warning_comes_before_the_analysis(machine, caplog) -> None:
    machine(0)
    spline = SimpleNamespace(control=np.zeros((900, 3)))
    stage = Stage("analysis", lambda *given: logging.warning("analysis"))
    run = SimpleNamespace(
        solving=[stage], results=StageResults(), clock=Clock(), deadline=Deadline()
    )
    Run.solve(run, RunState(surface=None, spline=spline))
    first, second = caplog.messages
    assert first.startswith("warning: the analysis of 900 functions") and second == "analysis"
