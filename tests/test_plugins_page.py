"""docs/tutorials/training_and_plugin.md: its package works as written, from outside."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.conftest import ROOT

PAGE = (ROOT / "docs" / "tutorials" / "training_and_plugin.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(?:python|toml)\n# ([\w/.]+)\n(.*?)```", PAGE, re.DOTALL)
FILES = {name: "\n\n".join(text for of, text in BLOCKS if of == name) for name, _ in BLOCKS}
COMMANDS = [shlex.split(line) for line in re.findall(r"^polycube-.+$", PAGE, re.MULTILINE)]
MAIN = {"polycube-train": "train.py", "polycube-infer": "infer.py"}
QUICK = {
    "polycube-train": ["batches_per_epoch=1", "batch_size=2", "held_out=2", "trainer.max_epochs=1"],
    "polycube-infer": ["structure=slices", "meshing.size=14%", "order=[meshing,report]"],
}


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """What pip installs of the package's files, and its test next to it."""
    source = tmp_path_factory.mktemp("acme-polycube")
    for name, text in FILES.items():
        path = source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    wheels = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-q"]
    subprocess.run([*wheels, "-w", source / "dist", source], check=True)
    folder = tmp_path_factory.mktemp("site")
    [wheel] = (source / "dist").glob("*.whl")
    zipfile.ZipFile(wheel).extractall(folder)
    shutil.copytree(source / "tests", folder / "tests")
    return folder


def run(package: Path, *arguments: object) -> str:
    paths = os.pathsep.join([str(package), str(ROOT)])
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=package,
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_one_python_file_holds_a_plugin_of_each_kind() -> None:
    assert set(FILES) == {"pyproject.toml", "acme_polycube.py", "tests/test_acme.py"}
    kinds = re.findall(r'@register\("([\w/]+)"', FILES["acme_polycube.py"])
    assert kinds == ["primitive", "schedule", "meshing/optimize", "export"]


@pytest.mark.slow
def test_every_plugin_keeps_its_promises(package: Path) -> None:
    assert FILES["tests/test_acme.py"].count("check_plugin(") == 5
    run(package, "tests/test_acme.py")


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_the_commands_compose_with_them(package: Path, command: list[str]) -> None:
    name, *overrides = command
    output = run(package, ROOT / MAIN[name], "--cfg", "job", *overrides)
    plugins = {"polycube-train": ["geometric"], "polycube-infer": ["laplacian", "csv"]}[name]
    assert all(f"plugin: {plugin}" in output for plugin in plugins)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_the_commands_run(package: Path, command: list[str]) -> None:
    name, *overrides = command
    run(package, ROOT / MAIN[name], *overrides, *QUICK[name])
    made = {"polycube-train": "outputs/train/*/weights/*", "polycube-infer": "results/hex.csv"}
    assert list(package.glob(made[name]))
