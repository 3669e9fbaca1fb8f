"""Names, groups and units of STEP files, as ISO 10303-21 writes them."""

import re
import time
from pathlib import Path

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.named_sets import cad_sets
from polycube.io.cad import Cad
from polycube.io.file_units import file_unit
from polycube.io.step.text import decoded, exchange
from polycube.io.surfaces import read_surface
from polycube.names import plain
from polycube.units import METRES
from tests.conftest import first_quick
from tests.fixtures import step_files
from tests.fixtures.exports import export
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.step_files import UNITS, box, side_of

ALIKE = [unit for unit in UNITS if unit not in ("m", "in", "km", "nm")]


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("plain", "plain"),
        ("O''Ring ''''", "O'Ring ''"),
        (r"a\\b", r"a\b"),
        (r"\X\E9t\X\E9", "été"),
        (r"\X2\56FA5B9A9762\X0\-1", "固定面-1"),
        (r"\X2\D83DDE00\X0\\X4\0001F600\X0\!", "😀😀!"),
        (r"Gr\S\v\S\_e", "Größe"),
        (r"\PE\\S\4", "Д"),
        (r"\PC\\S\j\PA\\S\j", "êê"),
        (r"\X2\56FA", "固"),
        (r"\X2\56\X0\ \Q\ 50%", r"\X2\56\X0\ \Q\ 50%"),
        ("two\nlines", "twolines"),
        ("固定面", "固定面"),
    ],
)
def test_strings_are_decoded_by_the_standard(written, name) -> None:
    assert decoded(written) == name


def test_a_statement_ends_at_no_semicolon_of_a_string_or_comment(tmp_path) -> None:
    path = tmp_path / "a.step"
    path.write_text("#1 = A('x;#2=B(''y'')', /* ; #3='no' */ #4);\n#5=C ( 'NONE' , #1 ) ;")
    found = exchange(path)
    assert found.entities == {"1": "A('0',#4)", "5": "C('1',#1)"}
    assert found.name("1") == "x;#2=B('y')" and found.name("5") == ""
    assert (found.word("5"), found.references("5"), found.name("9")) == ("C", ["1"], "")


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "latin-1"])
def test_the_encoding_of_a_file_is_recognized(tmp_path, code) -> None:
    path = tmp_path / "a.step"
    path.write_bytes("#1=A('Größe');".encode(code))
    assert exchange(path).name("1") == "Größe"


@pytest.mark.parametrize("code", first_quick(1, ["gb18030", "cp932"]))
def test_names_in_another_encoding_stay_different_and_are_noted(tmp_path, code) -> None:
    names = ["固定面", "荷重面", "安全孔", "表面", "面表", "孔"]
    path = box(tmp_path / "a.step", names)
    path.write_bytes(path.read_text(encoding="utf-8").encode(code))
    surface, notes = read_surface(path)
    assert notes == ["the file is not UTF-8; its names were read as ISO 8859-1"]
    assert len(set(surface.region_names)) == 6
    named = re.compile("cad_(?!face_)")
    sets = [name for name in cad_sets(surface).numbers if named.match(name)]
    assert len({name.lower() for name in sets}) == 6
    assert [list(cad_sets(surface).numbers[name]) for name in sets] == [[k] for k in range(1, 7)]


@pytest.mark.parametrize("piece", first_quick(5, ["''", "/*", "#1=", "#", "(", "'", r"'\X2\ABCD"]))
def test_the_time_to_read_grows_with_the_size(tmp_path, piece) -> None:
    path = tmp_path / "a.step"
    path.write_text(piece * (2_000_000 // len(piece)))
    begin = time.process_time()
    exchange(path)
    assert time.process_time() - begin < 8  # a quadratic reader takes hours


@pytest.mark.parametrize("unit", first_quick(4, ["m", "in", "km", "nm", *ALIKE]))
def test_lengths_are_in_the_unit_of_the_file(tmp_path, unit) -> None:
    path = box(tmp_path / "a.step", unit=unit)
    assert file_unit(path) == unit
    if 1e-8 < METRES[unit] < 1e3:  # others are beyond the tolerance of Open CASCADE
        surface, notes = read_surface(path, Cad(units="auto"))
        assert surface.unit == unit and notes == []
        np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), step_files.SIDES, rtol=1e-6)


def test_the_unit_is_that_of_the_representation_with_the_solid(tmp_path) -> None:
    """A context of another representation comes first in the file."""
    path = box(tmp_path / "a.step", unit="in")
    other = (
        "#9101 = SHAPE_REPRESENTATION('',(),#9102);\n"
        "#9102 = (GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#9103))"
        f"REPRESENTATION_CONTEXT('',''));\n#9103 = {UNITS['m']};\n"
    )
    path.write_text(path.read_text().replace("DATA;\n", f"DATA;\n{other}", 1))
    assert file_unit(path) == "in"
    np.testing.assert_allclose(np.ptp(read_surface(path)[0].vertices, axis=0), step_files.SIDES)


def test_a_unit_that_is_defined_by_itself_is_refused(tmp_path) -> None:
    path = box(tmp_path / "a.step", unit="in")
    path.write_text(
        path.read_text().replace("LENGTH_MEASURE(25.4),#9002", "LENGTH_MEASURE(1.),#346")
    )
    with pytest.raises(InputError, match=r"a\.step: the length unit #346 is defined by itself"):
        read_surface(path)


@pytest.mark.parametrize(
    ("suffix", "text", "unit"),
    [
        ("igs", "1H,,1H;,4Hpart,5Ha.igs,3H;x,,3Hsys,32,38,6,308,15,,1.,{},{},1,.01;", None),
        ("stl", "", ""),
        ("glb", "", "m"),
        ("brep", "", ""),
    ],
)
def test_units_of_other_formats(tmp_path, suffix, text, unit) -> None:
    path = tmp_path / f"a.{suffix}"
    flags = {("1", "2HIN"): "in", ("2", "2HMM"): "mm", ("4", ""): "ft", ("8", "3HMIL"): "mil"}
    flags |= {("3", "2HCM"): "cm", ("6", "1HM"): "m", ("", ""): "in", ("9", "2HUM"): "um"}
    for (flag, name), expected in flags.items() if text else {("", ""): unit}.items():
        own = text.format(flag, name)
        rows = [own[i : i + 72].ljust(72) + "G" for i in range(0, len(own), 72)]
        path.write_text("".join(f"{row}{k:7d}\n" for k, row in enumerate(rows, start=1)))
        assert file_unit(path) == expected


def grouped(path: Path) -> Path:
    """A box whose groups have faces or a whole shell; an aspect names its faces one at a time."""
    box(path)
    one, two, three, *_ = step_files.faces(path)
    shell = path.read_text().partition(" = CLOSED_SHELL")[0].rpartition("#")[2]
    more = (
        f"#9201 = GROUP('held','');\n#9202 = APPLIED_GROUP_ASSIGNMENT(#9201,(#{one},#{two}));\n"
        "#9203 = SHAPE_ASPECT('seat','',#4,.T.);\n"
        f"#9204 = GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#9203,#10,#{two});\n"
        f"#9205 = GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#9203,#10,#{three});\n"
        f"#9206 = PRESENTATION_LAYER_ASSIGNMENT('top','',(#{three}));\n"
        f"#9207 = PRESENTATION_LAYER_ASSIGNMENT('all','',(#{shell}));\n"
    )
    box(path, ["", "seat"], more=more)
    text = path.read_text().replace("CLOSED_SHELL(''", "CLOSED_SHELL('skin'")
    path.write_text(text.replace("MANIFOLD_SOLID_BREP(''", "MANIFOLD_SOLID_BREP('Lever; A'"))
    return path


def test_groups_shells_and_aspects(tmp_path) -> None:
    path = grouped(tmp_path / "a.step")
    surface, _ = read_surface(path)
    assert surface.name == "Lever; A"
    groups = {"held": (1, 2), "seat": (2, 3), "skin": (1, 2, 3, 4, 5, 6)}
    assert surface.region_groups == groups and surface.region_names == ("", "seat", *4 * ("",))
    sets = {name: own.tolist() for name, own in cad_sets(surface).numbers.items()}
    assert sets["cad_seat"] == [2, 3] and sets["cad_held"] == [1, 2]


@pytest.mark.slow
def test_groups_are_layers_or_left_out_on_request(tmp_path) -> None:
    path = grouped(tmp_path / "a.step")
    layers, _ = read_surface(path, Cad(groups="layer"))
    assert layers.region_groups == {"top": (3,), "all": (1, 2, 3, 4, 5, 6)}
    assert not any(layers.region_names)
    for groups in ("none", "colour"):
        found, _ = read_surface(path, Cad(groups=groups))
        assert found.region_groups == {} and not any(found.region_names)


def style(first: int, colour: str) -> str:
    """The entities #first to #first + 6 of a style, as Open CASCADE writes them for FreeCAD."""
    chain = ["PRESENTATION_STYLE_ASSIGNMENT((#{}))", "SURFACE_STYLE_USAGE(.BOTH.,#{})"]
    chain += ["SURFACE_SIDE_STYLE('',(#{}))", "SURFACE_STYLE_FILL_AREA(#{})"]
    chain += ["FILL_AREA_STYLE('',(#{}))", "FILL_AREA_STYLE_COLOUR('',#{})", colour]
    rows = (f"#{n} = {each.format(n + 1)};\n" for n, each in enumerate(chain, start=first))
    return "".join(rows)


def test_a_colour_is_a_group_of_faces_and_that_of_a_face_is_stronger(tmp_path) -> None:
    path = box(tmp_path / "a.step")
    _, two, three, four, *_ = step_files.faces(path)
    solid = path.read_text().partition(" = MANIFOLD_SOLID_BREP")[0].rpartition("#")[2]
    red, own = "COLOUR_RGB('',1.,0.,0.)", "DRAUGHTING_PRE_DEFINED_COLOUR('yellow')"
    more = style(9210, "COLOUR_RGB('',0.5,0.5,1.)") + style(9220, red) + style(9230, own)
    more += f"#9201 = STYLED_ITEM('color',(#9210),#{solid});\n"
    for number, face, first in ((9202, two, 9220), (9203, three, 9220), (9204, four, 9230)):
        item = f"OVER_RIDING_STYLED_ITEM('overriding color',(#{first}),#{face},#9201);\n"
        more += f"#{number} = {item}"
    surface, _ = read_surface(box(path, more=more), Cad(groups="colour"))
    assert surface.region_groups == {
        "colour_8080ff": (1, 5, 6),
        "colour_ff0000": (2, 3),
        "colour_yellow": (4,),
    }
    found = cad_sets(surface).numbers
    assert [found[f"cad_colour_{name}"].tolist() for name in ("8080ff", "ff0000", "yellow")] == [
        *([1, 5, 6], [2, 3], [4])
    ]
    assert read_surface(path)[0].region_groups == {}


def test_named_edges_are_between_two_faces(tmp_path) -> None:
    """Each edge of a box is the whole border between two faces."""
    path = box(tmp_path / "a.step")
    text, count = path.read_text(), iter(range(100))
    names = {0: "Seam", 1: "weld; 1", 2: "Seam"}
    named = lambda _: f"EDGE_CURVE('{names.get(next(count), 'NONE')}'"  # noqa: E731
    path.write_text(re.sub(r"EDGE_CURVE\(''", named, text))
    surface, _ = read_surface(path)
    assert {name: len(pairs) for name, pairs in surface.region_edges.items()} == {
        "Seam": 2,
        "weld; 1": 1,
    }
    mesh = with_sets(hex_box((4, 3, 2), step_files.SIDES), surface)
    assert list(mesh.node_sets) == ["edge_Seam", "edge_weld_1"]
    for name, pairs in surface.region_edges.items():
        inside = np.zeros(len(mesh.vertices), bool)
        for pair in pairs:
            boxes = [surface.vertices[surface.faces[surface.region == n]] for n in pair]
            low = np.max([each.min(axis=(0, 1)) for each in boxes], axis=0) - 1e-9
            high = np.min([each.max(axis=(0, 1)) for each in boxes], axis=0) + 1e-9
            inside |= ((mesh.vertices >= low) & (mesh.vertices <= high)).all(axis=1)
        own = mesh.node_sets[f"edge_{plain(name)}"]
        assert own.tolist() == np.flatnonzero(inside).tolist()
    for form in ("abaqus", "exodus", "lsdyna", "nastran", "vtk", "febio"):
        assert b"edge_weld_1" in export(mesh, tmp_path, form).read_bytes()


def test_layers_are_those_of_step_files(tmp_path) -> None:
    path = tmp_path / "a.brep"
    path.write_text("")
    with pytest.raises(InputError, match=r"cad\.groups=layer is for STEP files"):
        read_surface(path, Cad(groups="layer"))


def test_every_name_is_on_its_own_face(tmp_path) -> None:
    sides = ["x0", "x1", "y0", "y1", "z0", "z1"]
    first, _ = read_surface(box(tmp_path / "a.step"))

    def side(surface, number):
        return side_of(surface.vertices[surface.faces[surface.region == number]].reshape(-1, 3))

    order = [side(first, number) for number in range(1, 7)]
    assert sorted(order) == sides
    named, _ = read_surface(box(tmp_path / "b.step", order))
    assert [side(named, n) for n in range(1, 7)] == list(named.region_names) == order
