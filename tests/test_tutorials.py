"""The commands of the tutorials run in their order; the Python of the how-to pages runs (slow)."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.fixtures.cad_parts import write
from tests.fixtures.pages import DOCS, lines, scripts

TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
SCRIPTS = [page for page in sorted((DOCS / "how-to").glob("*.md")) if scripts(page)]
MADE = {  # files that the commands of a tutorial leave
    "cad_to_abaqus": ["results/bracket/report.html", "results/deck/hex.inp"],
    "cad_faces_to_loads_and_modes": ["results/modes/modes.csv", "results/static/static.vtu"],
    "training_and_plugin": ["outputs/train/smoke/loss.png", "results/rod/hex.vtu"],
}


def run(command: str, folder: Path) -> None:
    """Run a command line as in a checkout, with its files in the folder."""
    words = shlex.split(command)[1:]
    words = [str(ROOT / words[0]) if words[0].endswith(".py") else words[0], *words[1:]]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, (command, done.stdout + done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_the_commands_of_a_tutorial_run(page: Path, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "plugins").symlink_to(ROOT / "plugins")
    write("bracket", tmp_path)  # skips where Gmsh does not load
    commands = [line for line in lines(page) if line.startswith("python ")]
    assert len(commands) >= 4
    for command in commands:
        run(command, tmp_path)
    assert all((tmp_path / name).is_file() for name in MADE[page.stem])


@pytest.mark.slow
@pytest.mark.parametrize("page", SCRIPTS, ids=lambda page: page.stem)
def test_the_python_of_a_page_runs(page: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    known: dict = {}
    for script in scripts(page):
        exec(script, known)


def test_the_pages_are_there() -> None:
    assert {page.stem for page in TUTORIALS} == set(MADE)
    assert "python" in {page.stem for page in SCRIPTS}
