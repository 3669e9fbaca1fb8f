"""The commands and the Python of the README and of docs/ work.

Every command is composed, and what it configures is built, so that names, options and their values
are right; Python is run.  The README's own commands are also run to their end (slow).
"""

import re
import shlex
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import pytest
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser

from polycube import __version__
from polycube.cli.command import in_full, with_input
from polycube.config import compose
from polycube.pipeline.improvement import Improvement, is_improvement
from polycube.pipeline.intake import read_part
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.registry import build
from tests.conftest import ROOT
from tests.fixtures.pages import PAGES, lines, scripts

PROGRAMS = {
    ("python", "infer.py"): "infer",
    ("python", "train.py"): "train",
    ("python", "-m", "polycube.evaluate"): "evaluate",
    ("polycube-infer",): "infer",
    ("polycube-train",): "train",
}
# of the command line: one of each
LISTS = {"mesh=": "part.step", "cad.solid=": "1", "cad.materials=": "null"}
FROM_OUTSIDE = (
    "docs/tutorials/training_and_plugin.md"  # composed with its package, in test_plugins_page.py
)


def of_all_pages(slow: bool = False) -> list:
    """Each command of each page; slow: those of other pages than the README."""
    mark = pytest.mark.slow
    return [
        pytest.param(
            *(page, line),
            id=f"{page.relative_to(ROOT)}: {line}",
            marks=[mark] if slow and page != ROOT / "README.md" else [],
        )
        for page in PAGES
        for line in dict.fromkeys(lines(page))
        if str(page.relative_to(ROOT)) != FROM_OUTSIDE or line.startswith("python ")
    ]


def choices(words: list[str]) -> list[list[str]]:
    """The overrides of each job that a command line makes."""
    words = [w for w in words if w not in ("-m", "--multirun") and not w.startswith("hydra")]
    values = []
    for word in words:
        for key, one in LISTS.items():
            word = key + one if word.startswith(key) else word
        [override] = OverridesParser.create().parse_overrides([word])
        several = override.is_sweep_override()
        key = override.get_key_element()
        values.append(
            [f"{key}={v}" for v in override.sweep_string_iterator()] if several else [word]
        )
    return [list(each) for each in product(*values)]


@cache
def check(program: str, *overrides: str) -> None:
    """Compose it, and build what it names; once for equal commands of several pages."""
    cfg = compose(program, overrides)
    if program == "infer":
        settings = Settings.of(cfg)
        kind = Improvement if is_improvement(settings) else Run
        kind(settings, read_part)
    else:
        kinds = ("schedule", "model", "data", "sampler")
        built = [build(kind, cfg[kind]) for kind in kinds if kind in cfg]
        assert built


@pytest.mark.parametrize(("page", "line"), of_all_pages(slow=True))
def test_a_command_is_right(page: Path, line: str, here: Path) -> None:
    words = shlex.split(line)
    if words[0] == "make":
        targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
        assert words[1] in targets
        return
    found = [n for n in (1, 2, 3) if tuple(words[:n]) in PROGRAMS]
    if not found:
        a_module = words[1] == "-m" and find_spec(words[2])
        assert words[0] == "python" and (a_module or (ROOT / words[1]).is_file()), line
        return
    (here / "parts").mkdir()
    for word in words:  # files of vertices that a spline's options read
        if word.endswith(".txt"):
            Path(word.partition("=")[2]).write_text("0 1\n")
    for overrides in choices(with_input(in_full(words[found[0] :]))):
        check(PROGRAMS[tuple(words[: found[0]])], *overrides)


@pytest.mark.parametrize(("page", "line"), of_all_pages())
def test_a_command_needs_no_more_quotes(page: Path, line: str) -> None:
    """Of bash and zsh; the latter refuses [ and ~ that match no file and no user."""
    bare = re.sub(r"'[^']*'|\"[^\"$`\\]*\"", "", line)
    assert not re.search(r"[][{}()*?<>|;&$`!\"'\\]|\s[~=]", bare)


def test_there_are_commands_on_most_pages() -> None:
    assert len(of_all_pages()) > 40
    assert len({param.values[0] for param in of_all_pages()}) > 8


def test_the_readme_is_one_screen() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(text) <= 80 and max(map(len, text)) <= 120


@pytest.mark.slow
def test_the_script_of_the_readme_runs(capfd, tmp_path: Path) -> None:
    [script] = scripts(ROOT / "README.md")
    quick = script.replace('"part.step", size="4%"', '"example:rod", size="14%"')
    quick = quick.replace("part.inp", str(tmp_path / "part.inp"))
    known: dict = {}
    exec(quick, known)
    assert known["part"].report["valid"] and known["part"].modes.frequency[-1] > 0


def test_the_citation_names_this_version() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == __version__ and cited["license"] == "BSD-3-Clause"
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'version = "{__version__}"\n' in project
    assert len(cited["preferred-citation"]["authors"]) == 5


@pytest.mark.slow
def test_the_commands_of_the_readme_run(tmp_path: Path) -> None:
    """On a made part, with fewer hexes and without what only takes time."""
    from polycube.examples.parts import example

    part = example("rod")
    rows = [f"v {x} {y} {z}\n" for x, y, z in part.vertices.tolist()]
    rows += [f"f {a} {b} {c}\n" for a, b, c in (part.faces + 1).tolist()]
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "rod.obj").write_text("".join(rows))
    for line in lines(ROOT / "README.md"):
        words = shlex.split(line)
        if words[0] == "make":
            continue
        words = [re.sub(r"^part\.\w+$", "parts/rod.obj", word) for word in words]
        words = ["context=[cube]" if word.startswith("context=") else word for word in words]
        if words[1] == "infer.py":
            words = [word for word in words if "meshing.size" not in word]
            structure = "given" if "context=[cube]" in words else "slices"
            words += ["meshing.size=14%", f"structure={structure}", "order=[meshing,spline]"]
        command = [sys.executable, ROOT / words[1], *words[2:]]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, (line, done.stdout + done.stderr)
    assert list(tmp_path.rglob("hex.vtu")) and list(tmp_path.rglob("hex.inp"))
