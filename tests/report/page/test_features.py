"""CAD features that a mesh preserves and loses: numbers, picture and list."""

import numpy as np
import pytest

from docs.generators.benchmark.__main__ import lost_on_mesh
from polycube.hexmesh.face_groups import facing, measure
from polycube.report.numbers import features as numbers_of
from polycube.report.page.hexes import features
from polycube.report.page.html import header
from polycube.report.page.views.viewer import viewer
from polycube.report.pictures.colours import LOST, LOST_FACE, PRESERVED, SURFACE, WORST, rgb
from polycube.report.pictures.features import lost_features, lost_segments
from polycube.report.pictures.pictures import draw, makers
from polycube.report.pictures.render import view
from polycube.state import RunState
from polycube.types import Goal
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.html import Outline
from tests.fixtures.surfaces import wedge


@pytest.fixture(scope="module")
def cut() -> RunState:
    """A cube of six CAD faces, and a mesh that reaches only to 0.9 of its height."""
    whole = hex_box((4, 4, 4))
    region = facing(measure(whole.vertices[whole.quads]).normal) + 1
    return RunState(surface_of(whole, region), hexes=hex_box((4, 4, 4), (1, 1, 0.9)))


@pytest.fixture(scope="module")
def found(cut):
    return numbers_of.numbers(cut.hexes, cut.surface)


def test_the_top_of_a_cube_is_lost_with_its_edges(found):
    """The four vertical edges and sides lose a tenth, more than 5 % of their samples."""
    assert found["points"] == {"all": 8, "lost": 4}
    assert found["curves"] == {"all": 12, "lost": 8}
    assert found["faces"] == {"all": 6, "lost": 5}
    corner = next(each for each in found["lost"] if each["kind"] == "point")
    assert corner["length"] == pytest.approx(0.1)
    assert corner["distance"] == pytest.approx(0.1 / np.sqrt(3))
    assert corner["at"][2] == 1 and len(corner["faces"]) == 3 and "cad_face_6" in corner["faces"]
    far = [each["distance"] for each in found["lost"]]
    assert far == sorted(far, reverse=True) and len(far) == 17


def test_the_report_uses_the_limits_by_which_the_mesh_was_judged(cut, found):
    """The mesh is 0.1 / sqrt(3) of the diagonal too low."""
    goal = Goal(features=0.06, feature_share=0.2)
    numbers = numbers_of.numbers(cut.hexes, cut.surface, goal)
    assert numbers["lost"] == [] and len(lost_segments(cut.hexes, cut.surface, goal)) == 0
    assert numbers_of.limit(numbers) == "6 % of the diagonal and 20 % of their size"
    edge = 0.2 / np.sqrt(3)  # the limit of an edge of the cube, as a share of the diagonal
    assert {each["limit"] for each in found["lost"]} == {Goal.features} and edge > Goal.features
    assert len(lost_segments(cut.hexes, cut.surface)) > 0


def test_a_mesh_that_fits_loses_nothing(cut):
    found = numbers_of.numbers(hex_box((4, 4, 4)), cut.surface)
    assert found["lost"] == [] and found["curves"] == {"all": 12, "lost": 0}
    page = features({"hex": {"features": found}}, {})
    assert "lost features" not in page


def test_sharp_places_are_listed_with_the_scaled_jacobian_that_they_allow():
    sharp = wedge(np.deg2rad(10))
    found = numbers_of.numbers(hex_box((1, 1, 1)), sharp)
    assert [each["degrees"] for each in found["acute"]] == pytest.approx([10, 10, 10])
    page = features({"hex": {"features": found}}, {})
    assert "Angles too small for a good hex: 3 edges and corners" in page
    assert "cad_face_3, cad_face_5" in page and "0.17" in page


def test_only_cad_models_have_features(run, found):
    assert numbers_of.numbers(run.hexes, run.surface) is None
    assert features({"hex": {"features": None}}, {}) == "" == features({}, {})
    assert "features" not in makers(run)


def test_the_picture_marks_what_is_lost(cut):
    scene = lost_features(cut.hexes, cut.surface)
    assert len(scene) == 6  # two views of the model, curves that are preserved, and lost ones
    model, preserved, lost = scene[:3]
    top = cut.surface.region == 6
    assert (model.colours[top] == rgb((LOST_FACE,))).all()
    assert (model.colours[cut.surface.region == 5] == rgb((SURFACE,))).all()
    assert (preserved.line_colour, lost.line_colour) == (PRESERVED, WORST)
    assert (preserved.points[:, 2] == 0).all() and lost.points[:, 2].max() > 1
    lengths = np.linalg.norm(np.diff(preserved.points[preserved.lines], axis=1), axis=-1)
    assert lengths.sum() == pytest.approx(4)


def test_lost_features_are_drawn_in_front_of_the_mesh(cut, run):
    mesh, lost = lost_on_mesh(cut.hexes, cut.surface)
    assert lost.line_colour == LOST and len(lost.lines) == len(
        lost_segments(cut.hexes, cut.surface)
    )
    towards = view()[2]
    assert (lost.points @ towards).min() > (mesh.points @ towards).max()
    assert len(lost_on_mesh(hex_box((4, 4, 4)), cut.surface)) == 1
    assert len(lost_on_mesh(run.hexes, run.surface)) == 1  # no CAD model


def test_the_3d_view_marks_what_is_lost(cut):
    lines = lost_segments(cut.hexes, cut.surface)
    assert lines[..., 2].max() > 1  # the crosses at the corners of the top reach beyond it
    assert "lost features" in viewer(cut.hexes, cut.surface)
    same = hex_box((4, 4, 4))
    assert len(lost_segments(same, cut.surface)) == 0
    assert "lost features" not in viewer(same, cut.surface)


def test_the_header_counts_preserved_features(found):
    page = " ".join(Outline(header({"hex": {"features": found}})).text)
    assert "9 of 26" in page and "4 of 8 points, 4 of 12 curves, 1 of 6 faces" in page
    all_preserved = {
        **found,
        **{f"{k}s": {"all": 5, "lost": 0} for k in ("point", "curve", "face")},
    }
    tile = header({"hex": {"features": all_preserved}})
    assert 'tile good"><span>CAD features preserved' in tile and "15 of 15" in tile
    assert 'tile warning"><span>CAD features preserved' in header({"hex": {"features": found}})
    assert "CAD features" not in header({"hex": {"features": None}})


@pytest.mark.slow
def test_the_picture_is_drawn(cut):
    pytest.importorskip("pyvista")
    assert draw({"features": lost_features(cut.hexes, cut.surface)})["features"][:4] == b"\x89PNG"


def test_the_list_tells_kind_faces_distance_and_place(found):
    page = features({"hex": {"features": found}}, {"features": b"\x89PNG"})
    shown = " ".join(" ".join(Outline(page).text).split())
    assert "points 8 4 curves 12 8 faces 6 5" in shown
    assert "17 lost features" in shown and "farther away than 0.3 % of the diagonal" in shown
    assert "point cad_face_2, cad_face_4, cad_face_6 5.774 0.1 (1, 1, 1)" in shown
    assert WORST in page and "<img" in page
