"""Preflight: exact counts and places, the file of places, the command."""

import numpy as np
import pytest
from omegaconf import OmegaConf

from polycube.cli.infer import _command
from polycube.config import compose
from polycube.io import manifest
from polycube.io.cad import Cad
from polycube.io.preflight import preflight
from polycube.surface.measures import diagonal, place
from polycube.surface.repair.steps import find_defects
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, joined, torus


def counts(surface: TriMesh) -> dict[str, int]:
    return {defect.problem: len(defect.items) for defect in find_defects(surface)}


def test_every_defect_is_counted():
    solid = box()
    assert counts(torus(48, 24)) == {}
    assert counts(TriMesh(solid.vertices, solid.faces[1:])) == {"open edges": 3}
    twice = TriMesh(solid.vertices, np.append(solid.faces, solid.faces[:1], axis=0))
    assert counts(twice)["faces given twice"] == 1
    assert counts(twice)["edges of more than two faces"] == 3
    turned = solid.faces.copy()
    turned[0] = turned[0, ::-1]
    assert counts(TriMesh(solid.vertices, turned)) == {"edges between faces of opposite sides": 3}
    inverted = TriMesh(solid.vertices, solid.faces[:, ::-1])
    assert counts(inverted) == {"faces of a surface that is inside out": 12}
    pair = joined(solid, box((2, 0, 0), (3, 1, 1)))
    assert counts(pair) == {"faces of separate pieces": 12}
    crossing = counts(joined(solid, box((0.5, 0.25, 0.25), (1.5, 0.75, 0.75))))
    assert crossing["faces that intersect others"] > 0
    fin = TriMesh(np.append(solid.vertices, [[2, 0.001, 0]], axis=0), [*solid.faces, [0, 4, 8]])
    assert counts(fin)["thin faces"] == 1
    flat = TriMesh(np.append(solid.vertices, [[2, 0, 0]], axis=0), [*solid.faces, [0, 4, 8]])
    assert counts(flat)["faces without area"] == 1


def test_a_vertex_where_two_solids_touch():
    faces = np.where(box().faces == 0, 7, box().faces + 8)  # the second's first corner: the last
    touching = TriMesh(
        np.concatenate([box().vertices, box().vertices + 1]), np.concatenate([box().faces, faces])
    )
    found = {defect.problem: defect for defect in find_defects(touching)}
    assert found["vertices where parts touch"].items.tolist() == [[7]]


@pytest.fixture
def damaged(tmp_path):
    """A box of 3 with an open corner and a vertex that is no number."""
    solid = box((0, 0, 0), (3, 3, 3))
    lines = [f"v {x} {y} {z}" for x, y, z in solid.vertices]
    faces = [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in solid.faces[1:]]
    path = tmp_path / "damaged.obj"
    path.write_text("\n".join([*lines, "v nan 0 0", *faces, "f 1 2 9"]))
    return path


def test_the_table_says_what_how_many_and_where(damaged):
    found = preflight(str(damaged), Cad(), "off")
    table = found.table()
    assert "8 vertices, 11 faces" in table
    assert "1  vertices that are not finite" in table
    assert "3  open edges" in table
    ends = next(d for d in found.defects if d.problem == "open edges").items
    middle = found.surface.vertices[ends[0]].mean(axis=0)
    assert place(found.surface, middle) in table
    assert not found.is_usable and "repair=safe makes it usable" in found.verdict
    assert preflight(str(damaged), Cad(), "safe").is_usable


def test_the_places_are_read_by_vtk(damaged, tmp_path):
    import pyvista

    found = preflight(str(damaged), Cad(), "off")
    mesh = pyvista.read(found.write(tmp_path / "places.vtp"))
    assert (mesh.n_lines, mesh.n_verts) == (3, 0)
    assert mesh["problem"].tolist() == [0, 0, 0]
    assert mesh.length <= diagonal(found.surface)


def command(*overrides: str) -> int:
    return _command(OmegaConf.create(compose("infer", overrides)))


@pytest.mark.slow
def test_the_command_only_looks_and_writes_on_request_only(damaged, here, capsys):
    before = set(here.iterdir())
    assert command(f"mesh={damaged}", "preflight=true") == 2
    output = capsys.readouterr()
    assert "3  open edges" in output.out
    assert output.err.startswith(f"error: {damaged}: ") and output.err.count("\n") == 1
    assert command(f"mesh={damaged}", "preflight=true", "repair=safe") == 0
    assert "usable: closed, genus 0, volume 27" in capsys.readouterr().out
    assert set(here.iterdir()) == before
    assert command(f"mesh={damaged}", "preflight=places.vtp") == 2
    made = {here / "places.vtp", here / manifest.NAME}
    assert set(here.iterdir()) - before == made
    assert command(f"mesh={damaged}", "preflight=places.vtp") == 2
    assert "would be overwritten" not in capsys.readouterr().err


def test_the_places_never_replace_a_file_of_the_user(damaged, here, capsys):
    (here / "mine.vtp").write_text("mine")
    assert command(f"mesh={damaged}", "preflight=mine.vtp") == 2
    output = capsys.readouterr()
    assert "mine.vtp would be overwritten" in output.err and output.err.count("\n") == 1
    assert output.out == ""  # refused before the work
    assert (here / "mine.vtp").read_text() == "mine"


@pytest.mark.parametrize(
    ("override", "message"),
    [("repair=bold", "must be one of off, safe"), ("preflight=places.stl", "the name of a .vtp")],
)
def test_invalid_options_are_refused(damaged, override, message, capsys):
    assert command(f"mesh={damaged}", override) == 2
    assert message in capsys.readouterr().err
