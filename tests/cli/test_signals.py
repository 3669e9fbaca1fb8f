"""Ctrl-C, SIGTERM and a budget of seconds at the program: the best mesh so far is saved."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from polycube import HOME
from polycube.cli.infer import _command
from polycube.cli.signals import terminable
from polycube.errors import MeshingError
from polycube.io.hex_meshes import read_hexes
from polycube.search.chain import Deadline
from polycube.stages import Clock
from tests.conftest import first_quick
from tests.fixtures.runs import FAST, config, run, tree

ROD = ("mesh=example:rod", *FAST)
MARK = "meshing/pillow"  # signals come when this stage ends: a valid mesh is there, none is best


@pytest.fixture(autouse=True)
def ctrl_c_is_handled() -> Iterator[None]:
    """In the background of a script Ctrl-C is ignored, and so by every program started there."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_sigterm_is_like_ctrl_c_and_is_remembered() -> None:
    with terminable() as interrupted:
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5)
        assert interrupted.is_set()
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_an_interruption_that_compiled_code_swallowed_is_not_a_failed_stage() -> None:
    def swallowed() -> None:
        raise SystemError("returned a result with an exception set")

    with pytest.raises(MeshingError, match="SystemError"):
        Clock().run("meshing/optimize", swallowed)
    with pytest.raises(KeyboardInterrupt), terminable() as interrupted:
        interrupted.set()
        swallowed()
    with pytest.raises(KeyboardInterrupt):
        Deadline(interrupt=interrupted).check()


@pytest.fixture
def at_end(monkeypatch) -> dict[str, Callable[[], object]]:
    """What happens when stages end, by their names."""
    calls: dict[str, Callable[[], object]] = {}
    original = Clock.run

    def ended(self: Clock, name: str, call: Callable):
        value = original(self, name, call)
        calls.get(name, int)()
        return value

    monkeypatch.setattr(Clock, "run", ended)
    return calls


def interrupted() -> None:
    raise KeyboardInterrupt


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_the_best_mesh_so_far_is_written_and_marked(sent, tmp_path, at_end, capsys) -> None:
    at_end["meshing/optimize"] = lambda: os.kill(os.getpid(), sent)
    assert _command(config(*ROD, f"output_dir={tmp_path}", "quiet=true")) == 130
    assert "interrupted; the best mesh so far is saved" in capsys.readouterr().err
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["valid"] and report["interrupted"]
    assert report["stopped"].startswith("meshing was interrupted")
    assert report["hex"]["min_scaled_jacobian"] > 0 and "spline" not in report
    assert len(read_hexes(str(tmp_path / "hex.vtu"))[0].hexes) == report["hex"]["hexes"]
    page = (tmp_path / "report.html").read_text()
    assert "Meshing was interrupted" in page
    assert not [name for name in tree(tmp_path) if Path(name).name.startswith(".")]

    at_end.clear()
    more = run(f"resume={tmp_path}", "from=meshing/refine", "order=[meshing]", *FAST)
    assert more["hex"] == report["hex"] and "interrupted" not in more


@pytest.mark.parametrize("last", first_quick(0, ["meshing/subdivide", "meshing/pillow"]))
def test_when_the_time_is_over_the_mesh_so_far_is_written(
    last, tmp_path, at_end, monkeypatch
) -> None:
    ended: list[str] = []
    at_end[last] = lambda: ended.append(last)
    monkeypatch.setattr(Deadline, "is_over", property(lambda self: bool(ended)))
    report = run(*ROD, f"output_dir={tmp_path}", "seconds=60", "order=[meshing]")
    assert ended == [last] and "meshing/optimize" not in report["seconds"]
    assert "interrupted" not in report and report["hex"]["hexes"] > 0
    assert report["stopped"].startswith("meshing was stopped at the time limit of 60 s; the result")
    is_fitted = last != "meshing/subdivide"
    assert report["valid"] == is_fitted
    assert is_fitted or "the mesh is not fitted" in report["failure"]


def test_without_time_for_a_structure_there_is_no_result(tmp_path, capsys) -> None:
    arguments = [*ROD, f"output_dir={tmp_path / 'out'}", "quiet=true", "seconds=0.001"]
    assert _command(config(*arguments)) == 3
    error = capsys.readouterr().err
    assert "the time limit of 0.001 s was reached before there was a structure" in error
    assert "give more seconds; no file was written" in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_before_there_is_a_mesh_nothing_is_called_valid(tmp_path, at_end) -> None:
    at_end["meshing/subdivide"] = interrupted
    report = run(*ROD, f"output_dir={tmp_path}", "order=[meshing]")
    assert report["interrupted"] and not report["valid"]
    assert report["failure"] == "interrupted before there was a valid mesh"


@pytest.mark.slow
def test_an_interruption_after_meshing_keeps_the_mesh(tmp_path, at_end) -> None:
    at_end["spline"] = interrupted
    report = run(*ROD, f"output_dir={tmp_path}", "order=[meshing,spline]")
    assert report["interrupted"] and report["valid"] and report["hex"]["hexes"] > 0
    assert report["stopped"] == "the run was interrupted after meshing"


@pytest.mark.slow
@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_ctrl_c_at_the_real_program(times, tmp_path) -> None:
    command = [sys.executable, str(HOME / "infer.py"), "mesh=example:rod", "structure=slices"]
    command += [f"output_dir={tmp_path}", "order=[meshing,report]", "meshing.size=5%"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        for line in process.stderr:
            if line.startswith(MARK):
                break
        for _ in range(times):
            process.send_signal(signal.SIGINT)
            time.sleep(0.05)
        errors = process.stderr.read()
        assert process.wait() == 130, errors
    assert "error: interrupted" in errors and "Traceback" not in errors
    assert not [name for name in tree(tmp_path) if Path(name).name.startswith(".")]
    if times == 1:
        report = json.loads((tmp_path / "report.json").read_text())
        assert report["interrupted"] and report["valid"]


@pytest.mark.parametrize("value", first_quick(2, ["0", "-5", "soon", "true", ".inf"]))
def test_seconds_must_be_a_positive_number(value, tmp_path, capsys) -> None:
    assert _command(config(*ROD, f"output_dir={tmp_path}", f"seconds={value}")) == 2
    assert "seconds must be null or a number, above 0; got" in capsys.readouterr().err
