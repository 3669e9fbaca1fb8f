"""A stranger's package, as users meet it: both wheels in a clean environment, and a training run.

Third-party dependencies come from the environment of the tests, our code from the wheel alone.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from polycube.registry import names

pytestmark = pytest.mark.slow  # wheels, environments and runs take seconds each
ROOT = Path(__file__).parents[1]
ACME = ROOT / "tests" / "acme_polycube"
EXAMPLES = ROOT / "docs" / "generators" / "reference" / "examples"
EXAMPLE = re.compile(r'^@register\("([\w/]+)", "(\w+)"\)', re.MULTILINE)


def run(*command: object, cwd: Path, fails: bool = False) -> str:
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PIP_"))}
    arguments = [str(word) for word in command]
    done = subprocess.run(
        arguments, cwd=cwd, env=clean, capture_output=True, text=True, check=False
    )
    output = done.stdout + done.stderr
    assert (done.returncode != 0) is fails, output
    return output


def wheel(project: Path, folder: Path) -> Path:
    """Build a wheel with the backend of this environment; no network."""
    options = ("--no-deps", "--no-build-isolation", "--no-index", "-q", "-w", folder)
    run(sys.executable, "-m", "pip", "wheel", project, *options, cwd=folder)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def wheels(tmp_path_factory) -> list[Path]:
    pytest.importorskip("hatchling")
    folders = [tmp_path_factory.mktemp(name) for name in ("ours", "acme")]
    return [wheel(p, folder) for p, folder in zip((ROOT, ACME), folders, strict=True)]


@pytest.fixture(scope="module")
def python(wheels: list[Path], tmp_path_factory) -> Path:
    """Interpreter of an environment with both wheels installed."""
    folder = tmp_path_factory.mktemp("environment")
    run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=folder)
    python = folder / "bin" / "python"
    site = Path(
        run(python, "-c", "import sysconfig as s; print(s.get_path('purelib'))", cwd=folder).strip()
    )
    # a plain path: the .pth files over there, such as that of an editable install, stay unread
    (site / "shared.pth").write_text(sysconfig.get_path("purelib") + "\n")
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", "-q",
        *wheels, cwd=folder)  # fmt: skip
    return python


def test_wheel_holds_plugins_and_conf_inside_the_package(wheels: list[Path]) -> None:
    packed = {info.filename: info.compress_size for info in zipfile.ZipFile(wheels[0]).infolist()}
    names = set(packed)
    folders = {name.split("/")[0] for name in names}
    assert folders == {"polycube", next(f for f in folders if f.endswith(".dist-info"))}
    wanted = {"polycube/plugins/schedule.py", "polycube/conf/train.yaml"}
    wanted.add("polycube/plugins/export/templates/abaqus.inp")
    wanted |= {
        f"polycube/report/page/templates/{n}"
        for n in ("page.html", "page.css", "viewer.html", "viewer.js")
    }
    assert wanted <= names
    for yaml in (ROOT / "conf").rglob("*.yaml"):
        assert f"polycube/conf/{yaml.relative_to(ROOT / 'conf').as_posix()}" in names
    weights = {
        name: packed.pop(f"polycube/plugins/weights/{name}/weights.safetensors")
        for name in ("2x1", "2x2", "any", "paper")
    }
    assert max(weights.values()) < 5e6  # the published width of the U-Net is the largest
    assert sum(packed.values()) < 2e6  # all else
    assert not [name for name in names if "__pycache__" in name or name.endswith((".nbc", ".nbi"))]


def test_our_code_comes_from_the_wheel(python: Path, tmp_path: Path) -> None:
    output = run(
        python, "-c", "import polycube; print(polycube.__file__, polycube.HOME)", cwd=tmp_path
    )
    places = [Path(line) for line in output.split()]
    assert all(python.parents[1] in place.parents for place in places)


def test_the_strangers_own_tests_pass(python: Path, tmp_path: Path) -> None:
    shutil.copytree(ACME / "tests", tmp_path / "tests")  # away from our own pytest settings
    output = run(python, "-m", "pytest", "tests", cwd=tmp_path)
    assert "2 passed" in output


def test_the_examples_of_the_reference_keep_their_contracts(python: Path, tmp_path: Path) -> None:
    """Each module of docs/reference/plugins.md, with the program from its wheel."""
    modules = {path.stem: EXAMPLE.findall(path.read_text()) for path in EXAMPLES.glob("*.py")}
    assert len(modules) >= 18
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    code = f"import {', '.join(modules)}; from polycube.testing import check_plugin"
    for ((kind, name),) in modules.values():
        code += f"; check_plugin({kind!r}, {{'plugin': {name!r}}})"
    run(python, "-c", code, cwd=tmp_path / "examples")


def test_strangers_and_our_plugins_stand_side_by_side(python: Path, tmp_path: Path) -> None:
    code = "from polycube.registry import names; print(*names('schedule'), *names('primitive'))"
    output = run(python, "-c", code, cwd=tmp_path).split()
    ours = [*names("schedule"), *names("primitive")]
    assert sorted(output) == sorted([*ours, "quadratic", "notch"])


def test_training_composes_with_the_strangers_plugins(python: Path, tmp_path: Path) -> None:
    train = python.parent / "polycube-train"
    chosen = ("schedule=quadratic", "schedule.steps=77", "primitives=cube_and_notch")
    output = run(train, "--cfg", "job", *chosen, cwd=tmp_path)
    assert "plugin: quadratic" in output and "steps: 77" in output and "- notch" in output


def test_help_lists_the_strangers_plugins(python: Path, tmp_path: Path) -> None:
    output = run(python.parent / "polycube-train", "--help", cwd=tmp_path)
    lines = [" ".join(line.split()) for line in output.splitlines()]
    about = "beta_t grows with the square of t: slow while most of the polycube is left"
    assert f"quadratic {about}" in lines
    assert any(line.startswith("cube_and_notch ") for line in lines)
    assert any(line.startswith("notch A cell with one of its edges along y cut") for line in lines)


def test_a_surface_all_the_way_from_a_foreign_folder(python: Path, tmp_path: Path) -> None:
    """By the command and in Python; paths start from there."""
    write = "from polycube.examples.parts import example; e = example('dice'); print(*("
    write += "'v %r %r %r' % tuple(v) for v in e.vertices.tolist()), "
    write += "*('f %d %d %d' % tuple(f) for f in (e.faces + 1).tolist()), sep='\\n')"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "part.obj").write_text(run(python, "-c", write, cwd=tmp_path))
    quick = ("structure=slices", "meshing.size=14%")
    infer = python.parent / "polycube-infer"
    run(infer, "mesh=mine/part.obj", "output_dir=made", *quick, cwd=tmp_path)
    assert (tmp_path / "made" / "report.html").is_file()
    code = "import polycube; part = polycube.mesh('mine/part.obj', 'structure=slices', "
    code += "'meshing.size=14%'); print(part.modes.frequency[-1] > 0, part.report['valid'])"
    assert "True True" in run(python, "-c", code, cwd=tmp_path)


def test_a_name_nobody_has_is_refused_with_the_names_there_are(
    python: Path, tmp_path: Path
) -> None:
    train = python.parent / "polycube-train"
    output = run(train, "--cfg", "job", "schedule=squared", cwd=tmp_path, fails=True)
    assert "squared" in output and "quadratic" in output and "linear" in output


def test_a_short_training_with_the_strangers_plugins(python: Path, tmp_path: Path) -> None:
    train = python.parent / "polycube-train"
    chosen = ("experiment=smoke", "schedule=quadratic", "primitives=cube_and_notch")
    small = ("batches_per_epoch=2", "batch_size=4", "held_out=4", "trainer.max_epochs=1")
    run(train, *chosen, *small, cwd=tmp_path)
    assert list(tmp_path.rglob("weights.safetensors"))
