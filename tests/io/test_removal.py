"""Holes, fillets and faces that are removed from CAD solids, with exact volumes."""

import subprocess
import sys

import numpy as np
import pytest

from polycube.config import compose
from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.io.removal.options import Remove
from polycube.io.surfaces import read_surface
from polycube.pipeline.settings import Settings
from polycube.report.page.templates import element
from polycube.surface.measures import genus, volume
from tests.fixtures.step_files import named_by_place

SIZE = (100, 60, 10)
WRITE = """
import sys, gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ

def write(name):
    occ.synchronize()
    gmsh.write(f"{sys.argv[1]}/{name}.step")
    gmsh.clear()

drills = [occ.addCylinder(x, y, 0, 0, 0, 10, r) for x, y, r in
          ((10, 10, 2), (10, 50, 2), (30, 15, 6), (30, 45, 6))]
drills += [occ.addCylinder(50, 30, 6, 0, 0, 4, 2), occ.addCone(50, 30, 6, 0, 0, -1, 2, 0)]
drills += [occ.addCylinder(65, 30, 0, 0, 0, 10, 2), occ.addCone(65, 30, 7, 0, 0, 3, 2, 5)]
drills += [occ.addCylinder(85, 30, 0, 0, 0, 10, 2), occ.addCylinder(85, 30, 6, 0, 0, 4, 7)]
occ.cut([(3, occ.addBox(0, 0, 0, 100, 60, 10))], [(3, drill) for drill in drills])
write("plate")
block = occ.addBox(0, 0, 0, 60, 40, 20)
occ.synchronize()
upper = [edge for _, edge in gmsh.model.getEntitiesInBoundingBox(-1, -1, 19, 61, 41, 21, 1)]
occ.fillet([block], upper, [4])
write("block")
gmsh.option.setNumber("Geometry.OCCUnionUnify", 0)
halves = [(3, occ.addBox(x, 0, 0, 30, 40, 20)) for x in (0, 30)]
drill = occ.addCylinder(30, 20, 0, 0, 0, 20, 10)
occ.rotate([(3, drill)], 30, 20, 0, 0, 0, 1, 1.5707963267948966)
halves = occ.cut(halves, [(3, drill)])[0]
occ.fuse(halves[:1], halves[1:])
write("halves")
"""


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    """A drilled plate, a block whose four upper edges are rounded, and a bored block of halves."""
    folder = tmp_path_factory.mktemp("removal")
    subprocess.run([sys.executable, "-c", WRITE, str(folder)], check=True, capture_output=True)
    for path in folder.iterdir():
        path.write_text(named_by_place(path.read_text()))
    return folder


@pytest.fixture(scope="module")
def drilled(parts):
    """The plate without holes of d 4, a largest diameter in another unit; its notes."""
    return read_surface(parts / "plate.step", Cad(remove={"holes": "0.4cm", "fillets": 1}))


def test_small_holes_vanish_and_large_ones_remain(drilled):
    """Through and blind, with a cone at the bottom or the top, and one in a wider hole."""
    surface, _ = drilled
    after = np.prod(SIZE) - 2 * np.pi * 6**2 * 10 - np.pi * 7**2 * 4
    assert surface.removed["volume_after"] == pytest.approx(after, rel=1e-9)
    assert volume(surface) == pytest.approx(after, rel=2e-3)
    assert genus(surface) == 2
    rows = surface.removed["features"]
    assert [row["kind"] for row in rows if row["removed"]] == ["hole"] * 5
    np.testing.assert_allclose([row["size"] for row in rows], 4)
    assert sorted(len(row["faces"]) for row in rows) == [1, 1, 1, 2, 2]
    middles = np.array([row["place"][:2] for row in rows])
    expected = [(10, 10), (10, 50), (50, 30), (65, 30), (85, 30)]
    np.testing.assert_allclose(middles[np.lexsort(middles.T[::-1])], expected, atol=1e-6)
    assert all(row["names"] == ["Bore #1"] for row in rows)


def test_what_was_removed_is_said(drilled):
    _, notes = drilled
    assert notes == [
        "cad.remove.fillets=1: there is no such fillet",
        "cad.remove removed 5 holes with a diameter of 4 mm (7 of the CAD faces); the volume was "
        "56530.6 mm^3 and is 57122.3 mm^3 (+1.05 %)",
    ]


@pytest.mark.slow
def test_faces_that_remain_keep_number_and_name(parts, drilled):
    given, _ = read_surface(parts / "plate.step")
    surface, _ = drilled
    assert surface.region_names == given.region_names
    gone = {face for row in surface.removed["features"] for face in row["faces"]}
    assert {*surface.region.tolist()} == {*given.region.tolist()} - gone
    for face in np.unique(surface.region):
        new, old = (
            each.vertices[each.faces[each.region == face]].reshape(-1, 3)
            for each in (surface, given)
        )
        np.testing.assert_allclose(np.ptp(new, axis=0), np.ptp(old, axis=0), atol=1e-6)
        np.testing.assert_allclose(new.min(axis=0), old.min(axis=0), atol=1e-6)


def test_rounded_edges_vanish_and_what_cannot_is_kept(parts):
    """The opposite sides of a block do not meet: none can be removed."""
    wanted = {"fillets": 4, "faces": ["x 0"]}
    surface, notes = read_surface(parts / "block.step", Cad(remove=wanted))
    assert surface.removed["volume_after"] == pytest.approx(60 * 40 * 20, rel=1e-9)
    assert volume(surface) == pytest.approx(60 * 40 * 20, rel=1e-9)
    names = {surface.region_names[face - 1] for face in surface.region}
    assert names == {"x 0", "x 60", "y 0", "y 40", "z 0", "z 20"}
    fillet, side = surface.removed["features"]
    assert fillet["removed"] and fillet["kind"] == "fillet" and fillet["size"] == pytest.approx(4)
    assert not side["removed"] and side["names"] == ["x 0"]
    number = surface.region_names.index("x 0") + 1
    kept = f"which are kept: detail ('x 0', cad_face_{number}) at (0, 20, "
    assert kept in notes[1] and len(notes) == 2


@pytest.mark.slow
@pytest.mark.parametrize("faces", [["Bore #1"], "cad_Bore_1"])
def test_a_named_bore_vanishes_and_halves_of_a_side_become_one(parts, faces):
    surface, notes = read_surface(parts / "halves.step", Cad(remove={"faces": faces}))
    assert surface.removed["volume_after"] == pytest.approx(60 * 40 * 20, rel=1e-9)
    assert len(surface.removed["merged"]) == 4 and len(np.unique(surface.region)) == 6
    assert "belong to other faces of the same surface" in notes[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("face", "sentence"),
    [
        ("lid", "there is no CAD face 'lid'; the solid has cad_face_1 to cad_face_10, x 0, "),
        (11, "there is no CAD face 11; the solid has cad_face_1 to cad_face_10"),
    ],
)
def test_unknown_faces_are_refused(parts, face, sentence):
    with pytest.raises(InputError, match=r"block\.step: cad\.remove\.faces: ") as error:
        read_surface(parts / "block.step", Cad(remove={"faces": [face]}))
    assert sentence in str(error.value)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"holes": 0}, "cad.remove.holes: it must be a positive length, .* got 0"),
        ({"holes": "-3mm"}, "cad.remove.holes: .* got '-3mm'"),
        ({"fillets": "3 miles"}, "cad.remove.fillets: .* got '3 miles'"),
        ({"fillets": float("nan")}, "cad.remove.fillets: .* got nan"),
        ({"faces": [0]}, "cad.remove.faces: it must be a list of names and of numbers .* got 0"),
        ({"faces": 1.5}, "cad.remove.faces: .* got 1.5"),
        ({"hole": 3}, "cad.remove takes holes, fillets, faces; got 'hole'"),
    ],
)
def test_options_make_sense(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        Cad(remove=options)


def test_a_number_is_in_the_unit_of_the_file():
    found = Remove(holes=2, fillets="5.08 mm").in_unit("in", 25.4)
    assert found == {"holes": 50.8, "fillets": pytest.approx(5.08), "faces": ()}
    assert Remove().in_unit("mm", 1.0) == {}


@pytest.mark.parametrize("mesh", ["example:rod", "part.stl"])
def test_features_of_other_files_are_not_removed(mesh):
    with pytest.raises(InputError, match="removed from STEP, IGES and BREP files"):
        Settings.of(compose("infer", [f"mesh={mesh}", "cad.remove.holes=3"]))


def test_the_page_lists_them(drilled):
    surface, _ = drilled
    report = {"input": {"path": "a", "removed": surface.removed}}
    page = str(element("sections.html", "input", None, report["input"], "mm"))
    assert "Features removed from the CAD model" in page and page.count("<td>hole</td>") == 5
