"""The commands of the tutorials run and print what the page says; the Python of how-to pages runs.

Numbers may differ by 5 %, because triangulations and sums differ between versions of libraries.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.fixtures.cad_parts import write
from tests.fixtures.pages import DOCS, lines, outputs, scripts

TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
SCRIPTS = [page for page in sorted((DOCS / "how-to").glob("*.md")) if scripts(page)]
MADE = {  # files that the commands of a tutorial leave
    "cad_to_abaqus": ["results/bracket/report.html", "results/deck/hex.inp"],
    "cad_faces_to_loads_and_modes": ["results/modes/modes.csv", "results/static/static.vtu"],
    "training_and_plugin": ["outputs/train/smoke/loss.png", "results/rod/hex.vtu"],
}


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
PLACE = re.compile(r"\((\S+), \S+, (\S+)\)")
DISPLACEMENT = re.compile(r"largest displacement of ([\d.]+) mm")  # as the page says it


def run(command: str, folder: Path) -> str:
    """Output of a command line, run as in a checkout with its files in the folder."""
    words = shlex.split(command)[1:]
    words = [str(ROOT / words[0]) if words[0].endswith(".py") else words[0], *words[1:]]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, (command, done.stdout + done.stderr)
    return done.stdout + done.stderr


def symmetric(line: str) -> str:
    """A line without what the symmetry of the bracket leaves open: y, and which of two holes."""
    return PLACE.sub(r"(\1, \2)", line).replace("cad_face_7", "cad_face_6")


def is_like(line: str, other: str) -> bool:
    """Whether two lines have equal text, and numbers that differ little."""
    line, other = symmetric(line), symmetric(other)
    if NUMBER.sub("#", line) != NUMBER.sub("#", other.strip()):
        return False
    one, two = (np.array(NUMBER.findall(text), float) for text in (line, other))
    return np.allclose(one, two, rtol=0.05, atol=0.02)


def largest_displacement(results: Path) -> float:
    """Of the nodes, from a result file of CalculiX."""
    table = results.read_text().partition("DISP")[2].partition("\n -3")[0]
    rows = [line[13:49] for line in table.splitlines() if line.startswith(" -1")]
    moves = [[float(row[i : i + 12]) for i in (0, 12, 24)] for row in rows]
    return float(np.linalg.norm(moves, axis=1).max())


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_the_commands_of_a_tutorial_run(page: Path, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "plugins").symlink_to(ROOT / "plugins")
    write("bracket", tmp_path)  # skips where Gmsh does not load
    commands = [line for line in lines(page) if line.startswith("python ")]
    assert len(commands) >= 4
    printed = "".join(run(command, tmp_path) for command in commands).splitlines()
    assert all((tmp_path / name).is_file() for name in MADE[page.stem])
    missing = [line for line in outputs(page) if not any(is_like(line, each) for each in printed)]
    assert not missing, "\n".join(printed)
    solve(page, tmp_path)


def solve(page: Path, folder: Path) -> None:
    """Run CalculiX where the page does, and compare with the displacement on the page."""
    text = page.read_text(encoding="utf-8")
    decks = re.findall(r"^ccx (\S+)$", text, re.MULTILINE)
    if decks and shutil.which("ccx"):
        for deck in decks:
            subprocess.run(["ccx", deck], cwd=folder, check=True, capture_output=True, timeout=300)
        found = largest_displacement(folder / f"{decks[-1]}.frd")
        assert found == pytest.approx(float(DISPLACEMENT.search(text)[1]), rel=0.02)


def test_lines_with_other_words_or_numbers_differ() -> None:
    assert is_like("error 0.632 mm", "  error 0.64 mm")
    assert not is_like("error 0.632 mm", "error 0.732 mm")
    assert not is_like("error 0.632 mm", "deviation 0.632 mm")
    assert is_like("cad_face_6 at (3, 12, 6)", "cad_face_7 at (3, 28, 6)")
    assert not is_like("at (3, 12, 6)", "at (4, 12, 6)")


def test_the_printed_lines_of_a_page_are_found() -> None:
    found = outputs(DOCS / "tutorials" / "cad_to_abaqus.md")
    assert any(line.startswith("valid hex mesh: ") for line in found)
    assert not any(line.startswith(("ccx", "python")) for line in found)


@pytest.mark.slow
@pytest.mark.parametrize("page", SCRIPTS, ids=lambda page: page.stem)
def test_the_python_of_a_page_runs(page: Path, here: Path) -> None:
    known: dict = {}
    for script in scripts(page):
        exec(script, known)


def test_the_pages_are_there() -> None:
    assert {page.stem for page in TUTORIALS} == set(MADE)
    assert "python" in {page.stem for page in SCRIPTS}
