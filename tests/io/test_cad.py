"""CAD files written by gmsh in another process, read back."""

import re
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.io.cad_worker import _names
from polycube.io.solids.listing import read_solids
from polycube.io.step.faces import named_faces
from polycube.io.surfaces import read_surface
from polycube.surface.measures import genus, volume
from tests.conftest import first_quick
from tests.fixtures.step_files import named_by_place

BORED = 100 * 60 * 40 - np.pi * 12**2 * 40  # volume
WRITE = """
import sys, gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
box = occ.addBox(5, -7, 3, 100, 60, 40)
drill = occ.addCylinder(55, 23, 3, 0, 0, 40, 12)
occ.cut([(3, box)], [(3, drill)])
if sys.argv[2] == "two":
    occ.addBox(200, 0, 0, 1, 2, 3)
occ.synchronize()
gmsh.write(sys.argv[1])
"""


def part(folder, suffix="step", solids="one"):
    path = folder / f"part.{suffix}"
    run = [sys.executable, "-c", WRITE, str(path), solids]
    subprocess.run(run, check=True, capture_output=True)
    return path


@pytest.fixture(scope="module")
def step(tmp_path_factory):
    return part(tmp_path_factory.mktemp("cad"))


@pytest.mark.parametrize("suffix", first_quick(1, ["step", "igs", "brep"]))
def test_a_bored_box_keeps_volume_place_and_hole(tmp_path, suffix):
    surface, warnings = read_surface(part(tmp_path, suffix))
    assert warnings == []
    assert genus(surface) == 1
    assert volume(surface) == pytest.approx(BORED, rel=2e-3)
    np.testing.assert_allclose(surface.vertices.min(axis=0), [5, -7, 3], atol=1e-5)
    np.testing.assert_allclose(surface.vertices.max(axis=0), [105, 53, 43], atol=1e-5)


def test_triangles_know_their_face(step):
    """Six sides of the box and the wall of the hole, each triangle on the right one."""
    surface, _ = read_surface(step)
    assert sorted(np.unique(surface.region)) == [1, 2, 3, 4, 5, 6, 7]
    assert surface.region_names == ("",) * 7
    assert sorted(surface.region_shapes) == ["cylinder"] + ["plane"] * 6
    off = []
    for face in range(1, 8):
        points = surface.vertices[surface.faces[surface.region == face]].reshape(-1, 3)
        flat = np.ptp(points, axis=0) < 1e-6
        radius = np.linalg.norm(points[:, :2] - [55, 23], axis=1)
        off.append(flat.any() or np.abs(radius - 12).max() < 1e-6)
    assert all(off)


def test_names_of_faces_are_those_of_the_file(tmp_path, step):
    path = tmp_path / "named.step"
    path.write_text(named_by_place(step.read_text()))
    surface, _ = read_surface(path)
    assert sorted(surface.region_names) == [
        "Bore #1",
        "x 105",
        "x 5",
        "y -7",
        "y 53",
        "z 3",
        "z 43",
    ]
    for face, name in enumerate(surface.region_names, start=1):
        points = surface.vertices[surface.faces[surface.region == face]].reshape(-1, 3)
        if name != "Bore #1":
            axis, place = name.split()
            assert points[:, "xyz".index(axis)] == pytest.approx(float(place))
    corner = np.array([[5.0, -7, 3], [1, 2, 3]])  # no face has these
    assert named_faces(path, ["Plane", "Plane"], [corner, corner[:0]]).faces == ("", "")


@pytest.mark.parametrize(
    ("groups", "expected"),
    [
        ("name", ["top", ""]),
        ("colour", ["colour_ff0000", ""]),
        ("layer", ["", ""]),
        ("none", ["", ""]),
    ],
)
def test_names_or_colours_of_gmsh(groups, expected):
    names, colours = ["Shapes/part/top", ""], [(255, 0, 0, 255), (0, 0, 255, 0)]
    model = SimpleNamespace(
        getEntityName=lambda _, side: names[side], getColor=lambda _, side: colours[side]
    )
    assert _names(SimpleNamespace(model=model), [0, 1], groups) == expected


@pytest.mark.slow
def test_more_segments_are_nearer_to_the_solid(step):
    off = [
        abs(volume(read_surface(step, Cad(segments=segments))[0]) - BORED) for segments in (12, 48)
    ]
    assert 8 < off[0] / off[1]  # 16 for chords of a circle


@pytest.mark.slow
def test_coordinates_are_in_the_unit_of_the_file(tmp_path, step):
    metres = tmp_path / "metres.step"
    text = step.read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    metres.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    surface, warnings = read_surface(metres, Cad(units="mm"))
    np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), [100, 60, 40], rtol=1e-6)
    assert warnings == [
        "the file's lengths are in m, but analysis.units=mm; use analysis.units=auto"
    ]
    assert surface.unit == "m"
    assert all(read_surface(metres, Cad(units=units))[1] == [] for units in ("m", "auto"))


@pytest.mark.slow
@pytest.mark.parametrize(("flag", "unit"), [("1,2HIN", "in"), ("4,2HFT", "ft"), ("6,2H M", "m")])
def test_lengths_of_iges_are_in_its_unit(tmp_path, flag, unit):
    """The faces of a part of 100 m are sewn to a solid as well as those of one of 100 mm."""
    path = part(tmp_path, "igs")
    text = path.read_text()
    assert text.count("2,2HMM") == 1 and read_surface(path)[0].unit == "mm"
    path.write_text(text.replace("2,2HMM", flag))
    surface, warnings = read_surface(path)
    assert surface.unit == unit and warnings == []
    np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), [100, 60, 40], rtol=1e-6)


@pytest.mark.slow
def test_several_solids_are_listed_and_one_can_be_chosen(tmp_path):
    path = part(tmp_path, solids="two")
    with pytest.raises(InputError, match=r"2 solids: 1 \(volume 22190.* 2 \(volume 6 mm3, from"):
        read_surface(path)
    with pytest.raises(InputError, match="there is no solid 3; the file contains 2"):
        read_surface(path, Cad(solid=3))
    assert volume(read_surface(path, Cad(solid=2))[0]) == pytest.approx(6)


@pytest.mark.parametrize(
    ("text", "sentence"),
    first_quick(
        1,
        [
            ("good morning", "not a readable .step file|contains no solid"),
            ("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", "no solid"),
        ],
    ),
)
def test_what_holds_no_solid_is_refused(tmp_path, text, sentence):
    path = tmp_path / "part.step"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence) as refused:
        read_surface(path)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_half_a_file_is_refused(tmp_path, step):
    path = tmp_path / "half.step"
    text = step.read_text()
    path.write_text(text[: len(text) // 2])
    with pytest.raises(InputError, match=r"half\.step"):
        read_surface(path)


def test_without_gmsh_the_reason_is_named(step, without_gmsh):
    reason = r"need gmsh, which cannot be loaded \(ImportError: libGLU.so.1: no such file\); pip"
    for read in (read_surface, read_solids):
        with pytest.raises(InputError, match=reason):
            read(step)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"segments": 2}, "cad.segments must be a whole number, 6 or more; got 2"),
        ({"segments": None}, "cad.segments .* got None"),
        ({"solid": 0}, "cad.solid must be a whole number, 1 or more, or all; got 0"),
        ({"solid": "all"}, "only by the command line, infer.py; give the number of one"),
        ({"groups": "face"}, "cad.groups must be one of name, colour, layer, none; got 'face'"),
        ({"solid": "a"}, "cad.solid .* got 'a'"),
    ],
)
def test_options_make_sense(options, sentence):
    with pytest.raises(InputError, match=sentence):
        Cad(**options)


@pytest.mark.parametrize("read", [read_surface, read_solids])
def test_a_brep_file_that_breaks_off_is_refused(tmp_path, read):
    """Open CASCADE would loop for ever at its end."""
    path = part(tmp_path, "brep")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match=r"part\.brep: the file is incomplete"):
        read(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (r"(CARTESIAN_POINT\('',)\([^)]*\)", r"\1(0.,1.)"),
        (r"(VERTEX_POINT\('',)#\d+", r"\1#999999"),
        (r"(#(\d+) = EDGE_LOOP\('',\()#\d+", r"\1#\2"),
    ],
    ids=["two coordinates", "no such point", "a loop that names itself"],
)
def test_names_of_faces_in_a_damaged_file_are_left_out(tmp_path, step, old, new):
    text = re.sub(r"ADVANCED_FACE\(''", "ADVANCED_FACE('SIDE'", step.read_text())
    damaged, changed = re.subn(old, new, text)
    assert changed
    path = tmp_path / "damaged.step"
    path.write_text(damaged)
    assert named_faces(path, ["Plane"], [np.eye(3)]).faces == ("",)


@pytest.mark.parametrize("rest", first_quick(1, [b"#1=", b"x\n", b"'", b"("]))
def test_what_follows_the_end_of_a_step_file_is_not_read(tmp_path, step, rest):
    path = tmp_path / "part.step"
    path.write_bytes(step.read_bytes() + rest * (100_000 // len(rest)))
    surface, warnings = read_surface(path)
    assert warnings == [] and volume(surface) == pytest.approx(BORED, rel=2e-3)


def test_units_that_refer_to_each_other_are_refused(testdata):
    with pytest.raises(InputError, match="is defined by itself"):
        read_surface(testdata / "cases3" / "unitcycle.step")
