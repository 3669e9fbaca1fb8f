"""Batches of parts: the list, results of earlier runs, the table, processes."""

import csv
import json
import os
import subprocess
import sys

import pytest

from polycube import HOME
from polycube.cli.batch import ROW, expanded, part_name, run_job, summarized
from polycube.errors import InputError
from polycube.io import manifest

QUICK = ["order=[]", "structure=slices"]


@pytest.fixture
def parts(here):
    (here / "parts").mkdir()
    for name in ("b.stl", "a.obj", "notes.txt"):
        (here / "parts" / name).touch()
    return here / "parts"


def test_one_part_stays_one_run(parts):
    for one in (["mesh=parts/a.obj"], ["mesh=example:rod", "seed=1"], ["--help"], ["mesh=no.stl"]):
        assert expanded(one) == one


@pytest.mark.parametrize(
    ("given", "listed"),
    [
        ("parts", "'parts/a.obj','parts/b.stl'"),
        ("parts/*.stl", "'parts/b.stl'"),
        ("'parts/a.obj','parts/b.stl'", "'parts/a.obj','parts/b.stl'"),
        ("parts/[ab].*", "'parts/a.obj','parts/b.stl'"),
        ("example:rod,parts/b.stl", "'example:rod','parts/b.stl'"),
    ],
)
def test_folders_patterns_and_lists_become_lists(parts, given, listed):
    found = expanded([f"mesh={given}", "seed=3", "meshing.size=4%,5%", "output_dir=x"])
    assert found[:3] == ["-m", f"mesh={listed}", "seed=3"]
    left_out = "hydra.job.config.override_dirname.exclude_keys="
    assert found[-1] == f"{left_out}[mesh,hex,output_dir,quiet,verbose,seed,output_dir]"
    assert expanded([f"mesh={given}", "--multirun"])[:2] == ["-m", f"mesh={listed}"]


def test_unusual_file_names_reach_hydra_unchanged(parts):
    (parts / "b.stl").rename(parts / "it's, so=1.stl")
    [listed] = [word for word in expanded(["mesh=parts/*.stl"]) if word.startswith("mesh=")]
    assert listed == "mesh='parts/it\\'s, so=1.stl'"


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("parts/*.ply", "there is no such file"),
        ("empty", "the folder contains no surface"),
        ("parts/a.obj,other/a.stl", "2 parts have the name a: parts/a.obj, other/a.stl"),
    ],
)
def test_invalid_lists_are_refused(parts, given, sentence):
    (parts.parent / "empty").mkdir()
    with pytest.raises(InputError, match=sentence):
        expanded([f"mesh={given}"])


def test_a_list_may_be_longer_than_a_path(parts):
    names = [f"parts/{number}.obj" for number in range(1000)]
    [_, mesh, *_] = expanded(["mesh=" + ",".join(names)])
    assert mesh == "mesh=" + ",".join(f"'{name}'" for name in names)


def test_a_job_is_not_done_twice_unless_something_changed(parts, tmp_path, capsys):
    done = []

    def job(cfg):
        done.append(cfg)
        return 3, "no luck"

    cfg = {"mesh": str(parts / "a.obj"), "hex": None, "seed": 0, "output_dir": None, "quiet": False}
    for _ in range(2):
        assert run_job(cfg, tmp_path, "", job) == 3
    assert len(done) == 1 and done[0]["output_dir"] == str(tmp_path)
    first, second = capsys.readouterr().err.splitlines()
    assert first.endswith(": no valid result; no luck")
    assert second.endswith(": no valid result, as before; no luck")
    run_job({**cfg, "quiet": True}, tmp_path, "", job)
    assert len(done) == 1
    run_job({**cfg, "seed": 1}, tmp_path, "", job)
    (parts / "a.obj").write_text("changed")
    run_job({**cfg, "seed": 1}, tmp_path, "", job)
    assert len(done) == 3


def test_a_job_may_have_materials_by_names_and_numbers(parts, tmp_path):
    cfg = {"mesh": "a.stl", "hex": None, "cad": {"materials": {"bolt": "steel", 2: "abs"}}}
    assert run_job(cfg, tmp_path, "", lambda cfg: (3, "")) == 3
    assert run_job(cfg, tmp_path, "", lambda cfg: (0, "")) == 3  # it is not repeated


def test_a_bug_in_one_job_leaves_the_others_alone(tmp_path):
    def job(cfg):
        raise KeyError("nothing")

    cfg = {"mesh": "example:rod", "hex": None}
    assert run_job(cfg, tmp_path, "", job) == 1
    row = json.loads((tmp_path / ROW).read_text())
    assert row["result"] == "failed" and row["says"] == "KeyError: 'nothing'"
    assert "Traceback" in (tmp_path / "failure.txt").read_text()


def test_the_table_has_successes_and_failures(tmp_path):
    for name, more in {
        "good<1>": {"exit": 0, "result": "valid", "hexes": 7, "says": ""},
        "bad": {"exit": 2, "result": "refused", "says": "not closed"},
    }.items():
        with manifest.writing(tmp_path / name) as scratch:
            (scratch / ROW).write_text(json.dumps({"part": name, "identity": "", **more}))
    (tmp_path / "good<1>" / "report.html").touch()
    (tmp_path / "foreign").mkdir()  # a file of another program is no row
    (tmp_path / "foreign" / ROW).write_text(json.dumps({"part": "foreign", "exit": 5}))
    assert [row["part"] for row in summarized(tmp_path)] == ["bad", "good<1>"]
    rows = list(csv.DictReader((tmp_path / "summary.csv").open()))
    assert [row["result"] for row in rows] == ["refused", "valid"]
    assert [row["hexes"] for row in rows] == ["", "7"]
    page = (tmp_path / "summary.html").read_text()
    assert page.count("<a href=") == 1
    assert '<a href="good%3C1%3E/report.html">good&lt;1&gt;</a>' in page
    assert "not closed" in page and "2 parts" in page


def test_tables_hold_no_formulas_and_no_control_characters(tmp_path):
    names = ["=1+1", "+a", "-b", "@c", "d\x1b[31m", "e\nf", "g\udcff", "plain"]
    for k, name in enumerate(names):
        with manifest.writing(tmp_path / f"{k}{name}") as scratch:
            row = {"part": name, "exit": 0, "result": "valid", "hexes": -7}
            (scratch / ROW).write_text(json.dumps(row))
    summarized(tmp_path)
    rows = list(csv.DictReader((tmp_path / "summary.csv").open(encoding="utf-8")))
    shown = ["'=1+1", "'+a", "'-b", "'@c", r"d\x1b[31m", r"e\nf", r"g\udcff", "plain"]
    assert [row["part"] for row in rows] == shown
    assert {row["hexes"] for row in rows} == {"-7"}
    assert "plain" in (tmp_path / "summary.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_any_file_name_has_a_row_and_a_folder_in_that_of_the_batch(parts):
    for path in parts.iterdir():
        path.unlink()
    for name in (b"...stl", b"${oc.env:SECRET}.stl", b"\xff\xfe.stl", b"=a\x1b[31m\nb.stl"):
        with open(os.fsencode(parts) + b"/" + name, "wb") as file:
            file.write(b"solid\nendsolid\n")
    ended = batch(parts.parent, "mesh=parts", "output_dir=out", SECRET="hidden")
    assert ended.returncode == 2 and "4 refused" in ended.stderr
    assert "\x1b" not in ended.stderr and "hidden" not in ended.stderr
    folders = {path.name for path in (parts.parent / "out").iterdir() if path.is_dir()}
    assert folders == {"part__", "_{oc.env:SECRET}", os.fsdecode(b"\xff\xfe"), "=a\x1b[31m\nb"}
    assert {path.name for path in parts.parent.iterdir()} == {"parts", "out"}
    with (parts.parent / "out" / "summary.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == 4


def test_names_of_parts():
    assert [part_name(p) for p in ("a/b.c.stl", "example:rod", "x")] == ["b.c", "rod", "x"]
    assert [part_name(p) for p in ("a/...stl", "..", "${x}.stl")] == ["part__", "part__", "_{x}"]


def batch(folder, *words, **variables):
    command = [sys.executable, str(HOME / "infer.py"), *QUICK, *words]
    given = {"capture_output": True, "text": True, "env": os.environ | variables}
    return subprocess.run(command, cwd=folder, **given)


@pytest.mark.slow
@pytest.mark.parametrize(
    "launcher",
    [
        [],
        pytest.param(["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"], marks=pytest.mark.slow),
    ],
)
def test_a_batch_ends_with_the_largest_exit_code_and_is_not_repeated(tmp_path, launcher):
    words = ["mesh=example:ring,nowhere.stl,example:dice", "output_dir=results", *launcher]
    first = batch(tmp_path, *words)
    assert first.returncode == 2
    lines = first.stderr.splitlines()
    assert sorted(line.partition(":")[0] for line in lines[:3]) == ["dice", "nowhere", "ring"]
    assert lines[-1] == "2 valid, 1 refused: results/summary.html"
    made = {path.name for path in (tmp_path / "results").iterdir()}
    files = {"multirun.yaml", "summary.csv", "summary.html", "polycube-files.json"}
    assert made == {"dice", "nowhere", "ring"} | files
    assert (tmp_path / "results/dice/report.json").is_file()
    repeated = batch(tmp_path, *words)
    assert repeated.returncode == 2 and repeated.stderr.count(", as before") == 3


@pytest.mark.slow
def test_a_batch_with_an_unknown_value_is_refused_in_one_sentence(tmp_path):
    done = batch(tmp_path, "mesh=example:rod,example:ring", "seed=${nothing}")
    assert done.returncode == 2
    assert done.stderr.startswith("error: Interpolation key 'nothing' not found")
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_without_a_folder_the_results_go_to_one_of_their_own(tmp_path):
    ended = batch(tmp_path, "mesh=nowhere.stl", "-m", "seed=1,2")
    assert ended.returncode == 2, ended.stderr
    [folder] = (tmp_path / "outputs").iterdir()
    assert {"nowhere,seed=1", "nowhere,seed=2"} <= {path.name for path in folder.iterdir()}


# sitecustomize.py of every process: the first job of part b kills its process
MORTAL = """
import os, pathlib, signal
from polycube.cli import infer

def job(cfg):
    begun = pathlib.Path("begun")
    if "b.stl" in cfg["mesh"] and not begun.exists():
        begun.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 0, ""

infer._silently = job
"""


@pytest.mark.slow
def test_a_killed_process_ends_the_batch_and_the_same_command_continues_it(parts):
    (parts.parent / "sitecustomize.py").write_text(MORTAL)
    path = os.pathsep.join([str(parts.parent), *sys.path])
    words = ["mesh=parts", "output_dir=out", "hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    ended = batch(parts.parent, *words, PYTHONPATH=path)
    assert ended.returncode == 1 and "TerminatedWorkerError" in ended.stderr
    finished = len(list((parts.parent / "out").rglob(ROW)))
    assert finished < 2 and not (parts.parent / "out" / "summary.html").exists()
    continued = batch(parts.parent, *words, PYTHONPATH=path)
    assert continued.returncode == 0, continued.stderr
    assert continued.stderr.count(", as before") == finished
    assert continued.stderr.splitlines()[-1] == "2 valid: out/summary.html"
