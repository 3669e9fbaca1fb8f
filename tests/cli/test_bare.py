"""The name of a part alone."""

import subprocess
import sys
from pathlib import Path

import pytest

from polycube import HOME
from polycube.cli.command import in_full, with_input

LAST = "meshing.size=3"


@pytest.fixture(autouse=True)
def here(here: Path) -> None:
    for name in ("part.step", "other.stl", "a=b.stl", "part.vtu", "strange"):
        (here / name).touch()
    (here / "parts").mkdir()


NAMES = ["part.step", "./part.step", "a=b.stl", "strange", "nowhere.STEP", "parts", "parts/*.stl"]


@pytest.mark.parametrize("name", [*NAMES, "example:rod"])
def test_the_only_part_is_the_mesh(name: str) -> None:
    flag = ["--config-dir", "."]  # its value is no part
    assert with_input([*flag, name, LAST]) == [*flag, f"mesh={name}", LAST]


def test_a_hex_mesh_is_the_value_of_hex() -> None:
    assert with_input(["part.vtu"]) == ["hex=part.vtu"]
    assert with_input(["mesh=part.step", "part.vtu"]) == ["mesh=part.step", "hex=part.vtu"]
    assert with_input(["resume=parts", "part.step"]) == ["resume=parts", "mesh=part.step"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["verbose"],
        ["part.step", "other.stl"],
        ["mesh=other.stl", "part.step"],
        ["hex=part.vtu", "part.vtu"],
        ["--help"],
        ["mesh=" + ",".join(f"parts/{n}.step" for n in range(1000))],
        [],
    ],
)
def test_anything_else_stays_as_it_is(arguments: list[str]) -> None:
    assert with_input(arguments) == arguments


@pytest.mark.slow
def test_a_missing_file_is_refused_in_one_sentence() -> None:
    command = [sys.executable, HOME / "infer.py", "nowhere.step"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("error: nowhere.step: there is no such file")


def test_short_names_stand_for_options() -> None:
    given = ["part.step", "size=3%", "material=brass", "meshing.size=2", "size", "-m"]
    full = ["part.step", "meshing.size=3%", "analysis.material=brass", "meshing.size=2"]
    assert in_full(given) == [*full, "size", "-m"]
