"""Runs that are stopped early keep the best valid mesh, say so, and end as they should."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from polycube import HOME
from polycube.cli.infer import _command
from polycube.errors import MeshingError
from polycube.io.hex_meshes import read_hexes
from polycube.pipeline.stages import Made
from polycube.pipeline.stopping import TimeIsUp, Watch, terminable
from tests.cli.test_infer import FAST, config, run, tree
from tests.fixtures.hexmeshes import hex_box

ROD = ("mesh=example:rod", *FAST)
MARK = "meshing/pillow"  # signals come when this stage ends: a valid mesh is there, none is best


def made(value: object) -> Made:
    return Made(value, None, 0.0, Counter())


@pytest.fixture
def mesh():
    return hex_box()


@pytest.fixture
def inverted(mesh):
    return replace(mesh, hexes=mesh.hexes[:, [4, 5, 6, 7, 0, 1, 2, 3]])


def test_valid_meshes_are_kept_with_what_they_belong_to(mesh, inverted) -> None:
    watch = Watch()
    one, other = watch.on({"chosen": 0}), watch.on({"chosen": 1})
    one.take("meshing/smooth", made(inverted), 0.0)
    assert watch.best(lambda state: 0.0) is None
    one.take("meshing/smooth", made(mesh), 0.0)
    other.take("meshing/smooth", made(mesh), 0.0)
    assert watch.best(lambda state: state["chosen"]) == {"chosen": 1, "hexes": mesh}
    assert watch.best(lambda state: -state["chosen"]) == {"chosen": 0, "hexes": mesh}
    assert watch.seconds == {"meshing/smooth": 0.0}


def test_hexes_that_are_not_fitted_yet_do_not_crowd_out_others(mesh) -> None:
    bent = replace(mesh, vertices=mesh.vertices + 0.2 * mesh.vertices[:, [1, 2, 0]] ** 2)
    watch = Watch()
    for number in range(9):
        watch.on({"chosen": number}).take("meshing/subdivide", made(mesh), 0.0)
    watch.on({"chosen": 9}).take("meshing/smooth", made(bent), 0.0)
    assert watch.best(lambda state: state["chosen"])["hexes"] is bent


def test_time_is_up_in_the_middle_of_a_stage(mesh) -> None:
    watch = Watch()
    watch.keep(mesh)
    begin = time.monotonic()
    with pytest.raises(TimeIsUp), watch.limited(0.1):
        while time.monotonic() < begin + 20:
            time.sleep(0.01)
    assert 0.1 <= time.monotonic() - begin < 10
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_without_a_valid_mesh_it_goes_on_to_the_first(mesh, inverted) -> None:
    watch = Watch()
    with watch.limited(1e-3):
        time.sleep(0.05)
        watch.take("meshing/smooth", made(inverted), 0.0)
        with pytest.raises(TimeIsUp):
            watch.take("meshing/pillow", made(mesh), 0.0)
    watch.take("meshing/pillow", made(mesh), 0.0)  # and no more when the limit is over


def test_beside_the_main_thread_time_is_up_between_stages(mesh) -> None:
    ended = []

    def work() -> None:
        watch = Watch()
        with watch.limited(1e-3):
            time.sleep(0.05)
            try:
                watch.take("meshing/pillow", made(mesh), 0.0)
            except TimeIsUp:
                ended.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert ended == [True]


def test_an_interruption_that_compiled_code_swallowed_is_not_a_failed_stage() -> None:
    watch = Watch()
    failed = Made(None, MeshingError("stage failed: SystemError"), 0.0, Counter())
    with pytest.raises(MeshingError):
        watch.take("meshing/optimize", failed, 0.0)
    with terminable() as asked:
        watch.asked = asked
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(5)
        with pytest.raises(KeyboardInterrupt):
            watch.take("meshing/optimize", failed, 0.0)
        with pytest.raises(KeyboardInterrupt), watch.limited(None):
            raise SystemError("returned a result with an exception set")
    with pytest.raises(SystemError), Watch().limited(None):
        raise SystemError("a bug")


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_the_best_mesh_so_far_is_written_and_marked(sent, tmp_path, monkeypatch, capsys) -> None:
    take = Watch.take

    def signalled(self: Watch, name: str, *rest: object) -> object:
        value = take(self, name, *rest)
        if name == MARK:
            os.kill(os.getpid(), sent)
        return value

    monkeypatch.setattr(Watch, "take", signalled)
    assert _command(config(*ROD, f"output_dir={tmp_path}", "quiet=true")) == 130
    assert "interrupted; the best mesh so far is kept" in capsys.readouterr().err
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["valid"] and report["interrupted"]
    assert report["stopped"].startswith("meshing was interrupted")
    assert report["hex"]["min_scaled_jacobian"] > 0 and "spline" not in report
    assert len(read_hexes(str(tmp_path / "hex.vtu"))[0].hexes) == report["hex"]["hexes"]
    page = (tmp_path / "report.html").read_text()
    assert "Valid hex mesh, to be looked at" in page and "Meshing was interrupted" in page
    assert not [name for name in tree(tmp_path) if Path(name).name.startswith(".")]

    monkeypatch.setattr(Watch, "take", take)
    more = run(f"resume={tmp_path}", "from=meshing/refine", "order=[meshing]", *FAST)
    assert more["hex"] == report["hex"] and "interrupted" not in more


def test_a_budget_of_seconds_is_kept(tmp_path) -> None:
    report = run(*ROD, f"output_dir={tmp_path}", "seconds=0.001", "order=[meshing]")
    assert report["valid"] and "interrupted" not in report
    assert report["stopped"].startswith("meshing was stopped after 0.001 s, as asked")
    assert "meshing/optimize" not in report["seconds"]
    assert not signal.getsignal(signal.SIGALRM)


def test_before_there_is_a_mesh_nothing_is_called_valid(tmp_path, monkeypatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("polycube.pipeline.run.search", interrupted)
    report = run(*ROD, f"output_dir={tmp_path}", "order=[meshing]")
    assert report["interrupted"] and not report["valid"]
    assert report["failure"] == "interrupted before there was a valid mesh"


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
        said = process.stderr.read()
        assert process.wait() == 130, said
    assert "error: interrupted" in said and "Traceback" not in said
    assert not [name for name in tree(tmp_path) if Path(name).name.startswith(".")]
    if times == 1:
        report = json.loads((tmp_path / "report.json").read_text())
        assert report["interrupted"] and report["valid"]


@pytest.mark.parametrize("value", ["0", "-5", "soon", "true", ".inf"])
def test_seconds_must_be_a_positive_number(value, tmp_path, capsys) -> None:
    assert _command(config(*ROD, f"output_dir={tmp_path}", f"seconds={value}")) == 2
    assert "seconds must be null or a positive number; got" in capsys.readouterr().err
