"""No command deletes or overwrites a file of the user; each refuses before its work."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from omegaconf import DictConfig, OmegaConf

from docs.generators import gallery
from polycube import HOME
from polycube.cli.batch import ROW, run_job
from polycube.cli.infer import _command
from polycube.cli.train import CHECKPOINTS, WEIGHTS, train
from polycube.config import compose
from polycube.errors import InputError
from polycube.examples.parts import example
from polycube.io.stl import write_stl
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import hex_box

QUICK = ("structure=slices", "quiet=true", "meshing.size=12%")


def config(name: str, *overrides: str) -> DictConfig:
    return OmegaConf.create(compose(name, overrides))


def infer(*overrides: str) -> int:
    return _command(config("infer", *QUICK, *overrides))


def tree(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture
def here(here) -> Path:
    dice = example("dice")
    write_stl(here / "dice.stl", dice.vertices, dice.faces)
    return here


def abaqus(path: Path) -> None:
    mesh = hex_box()
    rows = [f"{i}, {x:.17g}, {y:.17g}, {z:.17g}" for i, (x, y, z) in enumerate(mesh.vertices, 1)]
    hexes = [", ".join(map(str, row)) for row in np.insert(mesh.hexes + 1, 0, 1, axis=1)]
    path.write_text("\n".join(["*NODE", *rows, "*ELEMENT, TYPE=C3D8", *hexes, ""]))


@pytest.mark.parametrize(
    ("name", "overrides"),
    first_quick(
        2,
        [
            ("hex.inp", ["hex=hex.inp", "export=[abaqus]"]),
            ("repaired.stl", ["mesh=repaired.stl", "repair=safe"]),
            ("report.json", ["mesh=dice.stl"]),
            ("run.log", ["mesh=dice.stl"]),
            ("hex.msh", ["mesh=dice.stl", "export=[gmsh]"]),
            ("stages/structure.npz", ["mesh=dice.stl"]),
            ("report.html", ["mesh=dice.stl"]),
        ],
    ),
)
def test_a_file_of_a_results_name_is_refused_before_the_work(name, overrides, here, capsys):
    (here / name).parent.mkdir(exist_ok=True)
    if name == "repaired.stl":
        shutil.copy(here / "dice.stl", here / name)
    elif name == "hex.inp":
        abaqus(here / name)
    else:
        (here / name).write_text("mine")
    before = tree(here)
    assert infer(*overrides, "output_dir=.") == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1 and f"{name} " in errors
    assert "would be overwritten" in errors and "choose another output_dir" in errors
    assert tree(here) == before


@pytest.mark.slow
def test_an_input_among_the_results_survives(here):
    """What destroyed its own input: `hex=hex.inp output_dir=.`, `mesh=out/repaired.stl ...`."""
    abaqus(here / "hex.inp")
    before = (here / "hex.inp").read_bytes()
    assert infer("hex=hex.inp", "output_dir=.", "order=[]") == 0
    assert (here / "hex.inp").read_bytes() == before
    assert infer("mesh=dice.stl", "output_dir=out", "repair=safe", "order=[]") == 0
    repaired = (here / "out/repaired.stl").read_bytes()
    assert infer("mesh=out/repaired.stl", "output_dir=out", "order=[]") == 0
    assert (here / "out/repaired.stl").read_bytes() == repaired
    assert infer("mesh=out/repaired.stl", "output_dir=out", "repair=safe", "order=[]") == 2
    assert (here / "out/repaired.stl").read_bytes() == repaired


@pytest.mark.slow
def test_a_folder_of_an_earlier_run_is_used_again_unless_its_results_changed(here, capsys):
    assert infer("mesh=dice.stl", "output_dir=out", "order=[meshing]", "export=[vtk]") == 0
    assert infer("resume=out", "from=meshing/smooth", "order=[meshing]") == 0
    assert not (here / "out/hex.vtk").exists()
    with (here / "out/hex.vtu").open("a") as file:
        file.write("<!-- a note of the user's -->")
    before = tree(here)
    assert infer("mesh=dice.stl", "output_dir=out", "order=[meshing]") == 2
    assert infer("resume=out", "from=meshing/smooth", "order=[meshing]") == 2
    assert tree(here) == before
    assert "out/hex.vtu would be overwritten" in capsys.readouterr().err
    assert infer("resume=out", "from=meshing/smooth", "order=[meshing]", "output_dir=new") == 0


@pytest.mark.slow
@pytest.mark.parametrize("state", ["the manifest", "no manifest"])
def test_a_folder_without_a_manifest_is_the_users(here, state):
    assert infer("mesh=dice.stl", "output_dir=out", "order=[]") == 0
    if state == "no manifest":  # as the program left it before there were manifests
        (here / "out/polycube-files.json").unlink()
    code = 0 if state == "the manifest" else 2
    assert infer("mesh=dice.stl", "output_dir=out", "order=[]") == code


@pytest.mark.slow
def test_a_batch_refuses_a_row_and_a_table_of_the_user(here, capsys):
    command = [sys.executable, str(HOME / "infer.py"), "mesh=example:dice,example:ring", "order=[]"]
    (here / "out").mkdir()
    (here / "out/summary.csv").write_text("mine")
    before = tree(here)
    ended = subprocess.run([*command, "output_dir=out"], capture_output=True, text=True)
    assert ended.returncode == 2 and "summary.csv would be overwritten" in ended.stderr
    assert ended.stderr.count("\n") == 1 and tree(here) == before
    cfg = {"mesh": "dice.stl", "hex": None}
    (here / "job").mkdir()
    (here / "job" / ROW).write_text('{"mine": 1}')
    with pytest.raises(InputError, match=r"row\.json would be overwritten"):
        run_job(cfg, here / "job", "", lambda cfg: (0, ""))
    assert (here / "job" / ROW).read_text() == '{"mine": 1}'


@pytest.mark.parametrize("name", ["loss.png", WEIGHTS[0], CHECKPOINTS[1]])
def test_a_training_refuses_a_folder_with_a_file_of_the_user(name, here):
    (here / "out" / name).parent.mkdir(parents=True)
    (here / "out" / name).write_text("mine")
    with pytest.raises(InputError, match=f"{name} would be overwritten.*another hydra.run.dir"):
        train(config("train", "experiment=smoke"), here / "out")
    assert (here / "out" / name).read_text() == "mine"


def test_the_gallery_replaces_only_a_gallery(here):
    (here / "gallery.md").write_text("# My pictures\n")
    with pytest.raises(InputError, match="is not a gallery"):
        gallery.gallery(here, [])
    (here / "gallery.md").unlink()
    assert gallery.gallery(here, []) == gallery.gallery(here, [])
    (here / "gallery/part.png").write_text("mine")
    with pytest.raises(InputError, match=r"part\.png does not belong to"):
        gallery.gallery(here, [here / "part"])
