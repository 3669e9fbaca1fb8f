"""`--help`: the choices, with their defaults and descriptions."""

import re
import subprocess
import sys
from contextlib import redirect_stdout
from functools import cache
from io import StringIO

import pytest

from polycube import HOME
from polycube.cli.help import shown
from polycube.config import compose
from polycube.errors import InputError

CONF = HOME / "conf"
COMMANDS = "infer", "train", "evaluate"


@cache
def help_of(name: str, *words: str) -> str:
    with redirect_stdout(StringIO()) as out:
        assert shown(name, ["--help", *words])
    return out.getvalue()


def listed(text: str) -> dict[str, dict[str, str]]:
    """Group -> name -> description; the name of a default begins with *."""
    block = text.split("== Choices: group=option (* default) ==\n")[1].split("\n== Settings")[0]
    found: dict[str, dict[str, str]] = {}
    group = ""
    for line in block.strip().splitlines():
        if line.startswith(("  ", "* ")):
            name, _, what = line.removeprefix("  ").replace("* ", "*", 1).partition(" ")
            found[group][name] = what.strip()
        else:
            group = line
            found[group] = {}
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_listed_can_be_chosen_and_the_default_is_marked(name) -> None:
    text = help_of(name)
    assert max(map(len, text.split("== Settings")[0].splitlines())) <= 125
    groups = listed(text)
    plain = compose(name)
    for group, names in groups.items():
        if " " in group:  # names for lists, and groups as another
            continue
        assert all(len(what) > 5 for what in names.values())
        for option in names:
            chosen = option.lstrip("*")
            value = f"[{chosen}]" if group == "export" else chosen
            config = compose(name, [f"{group}={value}"])
            assert (config == plain) is option.startswith("*"), f"{group}={option}"
            assert name == "infer" or "???" not in str(config), f"{group}={option}"


def test_internal_groups_and_options_are_not_listed() -> None:
    found = listed(help_of("infer"))
    assert not {"primitive", "sampler", "schedule", "model", "trainer"} & set(found)
    assert "improve" not in found["meshing"] and "_settings" not in found["meshing"]
    cells = found["names for primitives.use=[...] and context=[...]"]
    assert cells["cube"] == "A full cell" and len(cells) == 14
    found = listed(help_of("train"))
    assert found["schedule"]["cosine"] == "Cosine schedule: changes slowly at both ends"
    assert "*linear" in found["schedule"] and "structure" not in found


@pytest.mark.parametrize("name", COMMANDS)
def test_settings_stand_with_their_comments(name) -> None:
    settings = help_of(name).split("== Settings: name=value ==\n")[1]
    lines = (CONF / f"{name}.yaml").read_text().splitlines()
    keys = [line for line in lines if re.match(r"\w+:", line)]
    own = [line for line in keys if line.split(":")[0] not in ("defaults", "hydra")]
    assert len(own) > 4 and all(line in settings for line in own)
    assert "defaults" not in settings and "hydra:" not in settings


def test_a_choice_has_a_help_of_its_own() -> None:
    text = help_of("infer", "spline=optimal", "spline.refine.levels=1")
    assert text.startswith("== spline: The solid of h2s in a larger space")
    assert "spline.angle=45.0\n    angle in degrees; " in text
    assert "spline.refine.levels=1\n    number of times that every" in text
    assert "Choices" not in text


@pytest.mark.slow
def test_a_bundle_and_a_list_have_a_help_of_their_own() -> None:
    text = help_of("infer", "meshing=parametric", "meshing.size=3%")
    assert "meshing.size=3%\n    wanted edge length" in text
    assert "meshing.subdivide.size=3%" in text and "meshing.map.level=3" in text
    assert "improve." not in text
    text = help_of("infer", "export=[abaqus,gmsh]")
    assert "export.abaqus.element=C3D8I\n" in text and "export.gmsh.version=4.1\n" in text


def test_help_of_an_unknown_choice_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean h2s"):
        shown("infer", ["--help", "spline=h3s"])


def test_help_imports_no_numerical_libraries() -> None:
    code = (
        "import sys; sys.argv = ['infer.py', '--help']\n"
        "from polycube.cli import infer_command\n"
        "infer_command()\n"
        "print(*sorted({name.partition('.')[0] for name in sys.modules}), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=HOME)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stderr.split())
    assert not loaded & {"torch", "lightning", "numba", "vtk", "vtkmodules", "matplotlib"}
