"""A wrong command line is refused in one sentence that names what would be right."""

import gc
import os
import subprocess
import sys

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from polycube import HOME
from polycube.cli.command import quoted, run_hydra, split
from polycube.errors import InputError
from tests.conftest import first_quick

WRONG = [
    ("infer", "meshing=5", "meshing=5: there is no such choice; have "),
    ("infer", "spline=null", "spline=null: there is no such choice; have "),
    ("infer", "grid=4x9", "grid=4x9: there is no such choice; have 1x1, 2x1"),
    ("infer", "meshing=morf", "did you mean morph; have morph, parametric"),
    ("infer", "export=[abacus]", "export=abacus: there is no such choice; did you mean abaqus"),
    ("infer", "mesing=morph", "no option mesing; did you mean meshing"),
    ("infer", "meshing.sze=4%", "no option meshing.sze; did you mean meshing.size; meshing has"),
    ("infer", "size=4%", "did you mean ranking.size or meshing.size;"),
    ("infer", "effort=[first", "cannot be read"),
    ("infer", "~foo", "'foo' does not exist"),
    ("train", "data=papr", "did you mean paper; have"),
    ("train", "trainer.max_epoch=2", "did you mean trainer.max_epochs"),
]


PATHS = [
    "my pärts (β)/träger #1.stl",
    "a=b/part.step",
    "it's (1).stl",
    "plain.stl",
    "a.stl,b.stl",
    "[a.stl,b.stl]",
]


@pytest.mark.parametrize("path", PATHS)
def test_a_path_need_not_be_quoted(path):
    [word] = quoted([f"mesh={path}"])
    [override] = OverridesParser.create().parse_overrides([word])
    if word != f"mesh={path}":
        assert override.value() == path
    else:
        assert path in PATHS[3:]


def test_a_file_with_a_comma_is_one_path(tmp_path):
    (tmp_path / "a.stl,b.stl").touch()
    [word] = quoted([f"mesh={tmp_path}/a.stl,b.stl"])
    [override] = OverridesParser.create().parse_overrides([word])
    assert override.value() == f"{tmp_path}/a.stl,b.stl"


@pytest.mark.parametrize(("config", "word", "words"), first_quick(4, WRONG))
def test_the_sentence_names_the_nearest_choice(config, word, words, argv):
    argv("program", word)
    with pytest.raises(InputError) as caught:
        run_hydra(config, lambda cfg: None)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_collector_runs_during_the_work_and_leaves_out_the_imports(argv):
    argv("program", "mesh=example:rod")
    states = []
    gc.disable()
    try:
        run_hydra("infer", lambda cfg: states.append((gc.isenabled(), gc.get_freeze_count() > 0)))
    finally:
        gc.unfreeze()
        gc.enable()
    assert states == [(True, True)]


def test_a_command_line_is_split_into_flags_and_overrides():
    known, unknown = split("mesh=part.stl size=3 -m --cfg job --mesh -x".split())
    assert known.overrides == ["mesh=part.stl", "size=3"]
    assert (known.multirun, known.cfg, known.help) == (True, "job", False)
    assert unknown == ["--mesh", "-x"]


def test_flags_of_other_programs_are_named(argv):
    argv("infer.py", "--mesh", "part.stl")
    with pytest.raises(InputError, match=r"unknown flag --mesh; .* mesh=value"):
        run_hydra("infer", lambda cfg: None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [(["infer.py", "mesh="], "no part given"), (["train.py", "dta=x"], "data")],
)
def test_programs_end_with_code_2_and_one_line(tmp_path, words, message):
    program = str(HOME / words[0])
    done = subprocess.run(
        [sys.executable, program, *words[1:]],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(HOME)},
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: ") and message in done.stderr
    assert not list(tmp_path.iterdir())


def test_flags_of_hydra_keep_their_values(argv, capsys):
    argv("train.py", "--cfg", "job", "schedule=cosine")
    run_hydra("train", lambda cfg: None)
    assert "plugin: cosine" in capsys.readouterr().out
