"""Named sets: their numbers, their colours, and the section of the page."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.face_groups import facing, measure
from polycube.hexmesh.named_sets import kind_of
from polycube.report.numbers.sets import numbers
from polycube.report.page.hexes import sets
from polycube.report.pictures.colours import AXIS_COLOURS, HOLES, SURFACE
from polycube.report.pictures.features import both_sides, memberships, quad_colours, set_colours
from polycube.state import RunState
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.html import Outline


@pytest.fixture(scope="module")
def block() -> RunState:
    """A block of 4 x 2 x 2 whose upper side is two CAD faces, called LEFT and RIGHT."""
    mesh = hex_box((4, 2, 2), (4, 2, 2))
    quads = measure(mesh.vertices[mesh.quads])
    region = facing(quads.normal) + 1
    region[(region == 6) & (quads.middle[:, 0] > 2)] = 7
    surface = surface_of(mesh, region, ("", "", "", "", "", "LEFT", "RIGHT"))
    return RunState(surface, path="block.step", hexes=with_sets(mesh, surface))


def text(page: str) -> str:
    return " ".join(" ".join(Outline(page).text).split())


def test_numbers_of_a_block(block):
    found = numbers(block.hexes, block.surface)
    assert found["z_max"] == {
        "kind": "direction",
        "quads": 8,
        "area": pytest.approx(8),
        "centroid": pytest.approx([2, 1, 2]),
        "normal": pytest.approx([0, 0, 1]),
    }
    assert found["cad_face_7"] == {
        "kind": "cad_face",
        "quads": 4,
        "area": pytest.approx(4),
        "centroid": pytest.approx([3, 1, 2]),
        "normal": pytest.approx([0, 0, 1]),
        "model_area": pytest.approx(4),
    }
    assert found["cad_RIGHT"]["quads"] == 4 and found["patch_0"]["kind"] == "patch"


def test_the_wall_of_a_hole_faces_all_ways(run):
    found = numbers(run.hexes, run.surface)
    assert found["hole_1"]["kind"] == "hole" and found["hole_1"]["quads"] == 12
    assert np.linalg.norm(found["hole_1"]["normal"]) < 0.1
    assert "model_area" not in found["hole_1"]


@pytest.mark.parametrize(
    ("name", "kind"),
    [("x_min", "direction"), ("hole_12", "hole"), ("cad_face_3", "cad_face"), ("patch_0", "patch")],
)
def test_the_kind_of_a_name(name, kind):
    assert kind_of(name) == kind and kind_of("cad_hole_1") == "cad_face"


def test_each_quad_has_the_colour_of_its_first_set(run):
    colours, mesh = quad_colours(run.hexes), run.hexes
    assert set(colours[mesh.sets["x_max"]]) == {AXIS_COLOURS[0]}
    assert set(colours[mesh.sets["z_min"]]) == {AXIS_COLOURS[5]}
    assert set(colours[mesh.sets["hole_1"]]) == {HOLES[0]}
    named = np.concatenate([own for name, own in mesh.sets.items() if kind_of(name) != "patch"])
    assert set(np.delete(colours, named)) <= {SURFACE}


def test_sets_in_others_have_their_colour(block):
    """The two CAD faces are in z_max; a set of all quads has none."""
    mesh = replace(block.hexes, sets={**block.hexes.sets, "cad_all": np.arange(40)})
    found = set_colours(mesh)
    assert found["cad_LEFT"] == found["cad_face_7"] == found["z_max"] == AXIS_COLOURS[4]
    assert "cad_all" not in found


def test_the_two_views_do_not_overlap(run):
    """The second view is the first, turned by half a turn; neither hides the other."""
    front, back = both_sides(run.hexes)
    size = np.linalg.norm(np.ptp(front.points, axis=0))
    assert size == pytest.approx(np.linalg.norm(np.ptp(run.hexes.vertices, axis=0)), rel=0.3)
    triple = [np.linalg.det(np.diff(layer.points[:4], axis=0)) for layer in (front, back)]
    assert triple[0] == pytest.approx(triple[1])
    from polycube.report.pictures.render import view

    seen = [layer.points @ view().T for layer in (front, back)]
    apart = [
        max(b[:, k].min() - a[:, k].max(), a[:, k].min() - b[:, k].max())
        for a, b in [seen]
        for k in (0, 1)
    ]
    assert max(apart) > 0
    named = [own for name, own in run.hexes.sets.items() if kind_of(name) != "patch"]
    assert len(front.lines) > 0 and len(named) == 7


def test_the_section_is_a_legend(block):
    report = {"hex": {"sets": numbers(block.hexes, block.surface)}}
    page = sets(block, report, {"sets": b"\x89PNG"})
    shown = text(page)
    assert "z_max direction 6, 7 8 8 (2, 1, 2) (0, 0, 1)" in shown
    assert "cad_RIGHT CAD face 7 4 4 (3, 1, 2) (0, 0, 1)" in shown
    assert "7 CAD faces" in shown and "1 patch of the polycube" in shown
    assert f"background:{AXIS_COLOURS[4]}" in page and "<img" in page
    assert "differs by" not in shown


def test_cad_faces_without_quads_are_listed_as_lost(block):
    """The mesh of the block has two quads of cad_face_6 less, and none of cad_face_7."""
    lost = dict(block.hexes.sets)
    lost["cad_face_6"] = lost["cad_face_6"][2:]
    del lost["cad_face_7"]
    state = replace(block, hexes=replace(block.hexes, sets=lost))
    shown = text(sets(state, {"hex": {"sets": numbers(state.hexes, state.surface)}}, {}))
    assert "differs by more than 10 %: 2 of 7 (cad_face_6, cad_face_7)." in shown
    assert "50.0%" in shown and "cad_face_7 CAD face 0" in shown and "0.0%" in shown


def test_without_a_mesh_or_sets_there_is_no_section(block):
    assert sets(RunState(block.surface), {}, {}) == ""
    assert sets(block, {"hex": {}}, {}) == ""


def test_the_view_names_the_sets_of_each_face(block):
    number, names = memberships(block.hexes)
    sets_of_quads = [set(names[n].split(", ")) for n in number]
    for name, own in block.hexes.sets.items():
        assert [name in each for each in sets_of_quads] == np.isin(np.arange(40), own).tolist()
    plain, none = memberships(replace(block.hexes, sets={}))
    assert set(plain) == {0} and none == [""]
