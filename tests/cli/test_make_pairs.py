"""python -m polycube.make_pairs: a file for each part that got a coarse polycube, and a table."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

from polycube.cli.make_pairs import TABLE, main, make_pairs, mesh_coarsely
from polycube.cli.train import train
from polycube.config import compose
from polycube.diffusion.pairs.part_files import read_part
from polycube.errors import InputError
from polycube.io.stl import write_stl
from polycube.structure.lattice import OUTWARD
from polycube.surface.measures import face_normals
from polycube.types import TriMesh
from tests.conftest import first_quick
from tests.fixtures.meshed import TURN, hexes_of, true_knots
from tests.fixtures.trainings import config

pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")


def write_part(path: Path, name: str) -> Path:
    """An STL file of the part, turned and far off the origin."""
    hexes = hexes_of(name, TURN, parts=1)
    used, faces = np.unique(hexes.quads[:, [[0, 1, 2], [0, 2, 3]]], return_inverse=True)
    write_stl(path, hexes.vertices[used], faces.reshape(-1, 3))
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict], Path]:
    """Rows and folder of a box, an L-prism, and a file that is no surface."""
    folder = tmp_path_factory.mktemp("made")
    for name in ("box", "L"):
        write_part(folder / f"{name}.stl", name)
    (folder / "broken.stl").write_text("solid of nothing")
    cfg = compose("make_pairs", [f"parts=['{folder}/*.stl']", "size=12%", "effort=first"])
    return make_pairs(cfg, folder / "pairs"), folder / "pairs"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["box", "L"])
def test_a_part_that_is_a_polycube_is_its_own_pair(
    made: tuple[list[dict], Path], name: str
) -> None:
    """Meshed by the pipeline: labels are outward normals, places the part's own coordinates.

    Within single precision, which is that of the STL file, at its distance from the origin.
    """
    part = read_part(made[1] / f"{name}.npz")
    assert part.surface.vertices == pytest.approx(part.geometry, abs=1e-4)
    normals = face_normals(TriMesh(part.geometry, part.surface.faces))
    assert normals == pytest.approx(OUTWARD[part.surface.axis], abs=2e-3)
    found = sorted(np.round(knots, 3).tolist() for knots in part.polycube.knots)
    widths = [np.diff(knots) for knots in true_knots(name)]
    either = {tuple(np.sort(w).round(3)) for w in widths}
    assert {tuple(np.sort(np.diff(k)).round(3)) for k in found} == either
    assert part.polycube.occupancy.sum() == (3 if name == "L" else 1)


@pytest.mark.slow
def test_what_gave_no_pairs_is_in_the_table(made: tuple[list[dict], Path]) -> None:
    rows, folder = made
    with (folder / TABLE).open(newline="", encoding="utf-8") as file:
        table = {row["part"]: row for row in csv.DictReader(file)}
    assert [row["part"] for row in rows] == list(table) == ["L", "box", "broken"]
    assert [row["result"] for row in rows] == ["pairs", "pairs", "no pairs"]
    assert table["broken"]["says"] and "broken.stl" in table["broken"]["says"]
    assert (table["L"]["genus"], float(table["L"]["tilted_percent"])) == ("0", 0.0)
    assert table["L"]["slabs"] in ("2x2x1", "2x1x2", "1x2x2")
    assert sorted(path.name for path in folder.glob("*.npz")) == ["L.npz", "box.npz"]


@pytest.mark.slow
def test_a_training_takes_them(made: tuple[list[dict], Path], tmp_path: Path) -> None:
    metrics = train(
        config("grid=any", "model=tiny", "data=parts", f"data.path='{made[1]}'"), tmp_path
    )
    assert metrics["samples"] == 16 and 0 <= metrics["right_knot"] <= 1


def test_a_file_of_the_users_is_not_overwritten(tmp_path: Path) -> None:
    """Nothing is meshed; the user's file stays as it is."""
    part = write_part(tmp_path / "box.stl", "box")
    (tmp_path / "box.npz").write_text("mine")
    with pytest.raises(InputError, match=r"box\.npz would be overwritten"):
        make_pairs(compose("make_pairs", [f"parts=['{part}']"]), tmp_path)
    assert (tmp_path / "box.npz").read_text() == "mine"
    assert not (tmp_path / TABLE).exists()


@pytest.mark.slow
def test_a_part_of_many_slabs_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("polycube.cli.make_pairs.MOST_SLABS", 1)
    monkeypatch.setattr(
        "polycube.cli.make_pairs.COARSE", ("structure=slices", "grid=2x1", "order=[meshing]")
    )
    part = write_part(tmp_path / "frame.stl", "frame")
    with pytest.raises(InputError, match="have more than 1 slabs along an axis"):
        mesh_coarsely(str(part), compose("make_pairs"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    first_quick(
        3,
        [
            ([], "error: parts: no parts given"),
            (["parts=[nothing*.stl]"], "error: parts: there is no file nothing*.stl"),
            (["parts=[a/x.stl,b/x.stl]"], "error: parts: 2 parts have the name x; rename them"),
            (["parts=[a/x.stl]", "effort=2"], "error: policy=best_gain: effort must be"),
            (["parts=[a/x.stl]", "size=none"], "error: meshing/subdivide=template: size must be"),
            (
                ["parts=[a/x.stl]"],
                "error: pairs/summary.csv: no part gave pairs; the table gives the reasons",
            ),
            (["sise=4%"], "error: there is no option sise"),
        ],
    ),
)
def test_no_pairs_and_wrong_options_are_one_sentence_and_exit_code_2(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("a", "b"):
        Path(folder).mkdir()
        Path(folder, "x.stl").write_text("solid of nothing")
    monkeypatch.setattr(sys, "argv", ["make_pairs", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err.strip().splitlines()[-1].startswith(message)
    assert not list(tmp_path.rglob("*.npz"))
