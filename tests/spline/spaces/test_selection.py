import re

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.connectivity import quad_edges
from polycube.io.hex_meshes import boundary
from polycube.spline.spaces.hierarchy import coarsest
from polycube.spline.spaces.selection import Refinement, check_listed
from polycube.spline.spaces.subdivision import ControlMesh
from polycube.types.checks import options_of
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder

NONE = np.zeros((0, 2), np.int64)


def marked(mesh, depth=0, surface=None, **options):
    level = coarsest(ControlMesh(mesh, NONE, np.zeros(0, np.int64)))
    return Refinement(**options).marked(level, depth, surface or boundary(mesh))


def test_no_element_is_refined_by_default():
    assert len(marked(hex_box())) == 0
    assert Refinement().listed() == []


def test_file_lists_levels_and_children(tmp_path):
    path = tmp_path / "lev_rfid.txt"
    path.write_text("0\t\t7\t\t\n0 2\n\n1 9\n")
    assert [e.tolist() for e in Refinement(elements=str(path)).listed()] == [[7, 2], [9]]
    assert [e.tolist() for e in Refinement(elements=[7, 2]).listed()] == [[7, 2]]


def test_box_marks_its_elements_and_their_ring():
    mesh, box = hex_box((5, 5, 5)), {"box": [0.45, 0.45, 0.45, 0.55, 0.55, 0.55], "level": 2}
    assert marked(mesh, boxes=[box], rings=0).tolist() == [62]
    assert len(marked(mesh, boxes=[box])) == 27
    assert len(marked(mesh, 1, boxes=[box], rings=0)) == 1
    assert len(marked(mesh, 2, boxes=[box], rings=0)) == 0


def test_curvature_marks_the_round_side():
    mesh = hex_cylinder(2, 2, 2)
    outside = (np.hypot(*mesh.vertices[mesh.hexes].T[:2]).max(axis=0) > 0.99).nonzero()[0]
    assert np.array_equal(marked(mesh, curvature=20, rings=0), outside)
    assert len(marked(mesh, curvature=179, rings=0)) == 0
    assert len(marked(mesh, 1, curvature=20)) == 0


def test_indicator_selects_the_fewest_elements_with_the_share():
    mesh = hex_ball(2)
    few, most = (marked(mesh, indicator=share, rings=0) for share in (0.1, 1.0))
    assert 0 < len(few) < len(most)
    outer = np.isin(mesh.hexes, mesh.quads).any(axis=1)
    assert outer[most].all()


def test_indicator_selects_nothing_without_distance():
    """The distances of a box from itself are rounding errors."""
    mesh = hex_box((4, 4, 4), high=(0.7, 0.9, 1.3))
    sharp, _ = quad_edges(mesh.quads)
    level = coarsest(ControlMesh(mesh, sharp, np.unique(sharp)))
    assert len(Refinement(indicator=0.3).marked(level, 0, boundary(mesh))) == 0


def test_a_box_without_elements_is_reported(caplog):
    assert len(marked(hex_box((2, 2, 2)), boxes=[{"box": [5, 5, 5, 6, 6, 6]}])) == 0
    assert "no element meets [5, 5, 5, 6, 6, 6]" in caplog.text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"levels": -1}, "refine.levels must be a whole number, 0 or more; got -1"),
        ({"boxes": [{"box": 5}]}, "a box of refine.boxes must be {box: [x, y, z, X, Y, Z], level"),
        ({"depth": 0}, "refine.depth must be a whole number, 1 or more; got 0"),
        ({"rings": 0.5}, "refine.rings must be a whole number, 0 or more; got 0.5"),
        ({"curvature": 200}, "refine.curvature must be a number, 0 to 180; got 200"),
        ({"indicator": "half"}, "refine.indicator must be a number, 0 to 1; got 'half'"),
        ({"elements": [1, -1]}, "refine.elements must be whole numbers >= 0 or a file"),
        ({"elements": [1, 1]}, "refine.elements contains an element of level 0 twice"),
        ({"elements": "nowhere.txt"}, "refine.elements: there is no file 'nowhere.txt'"),
        ({"boxes": [{"box": [0, 0, 0, 1, 1]}]}, "a box of refine.boxes must be {box: [x, y, z"),
        ({"boxes": [{"box": [0, 0, 1, 1, 1, 0]}]}, "must have its low corner first"),
        ({"boxes": [{"box": [0, 0, 0, 1, 1, 1], "level": 0}]}, "a box of refine.boxes must be"),
    ],
)
def test_invalid_options_are_refused_with_a_reason(options, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        options_of("refine", Refinement, options)


def test_refuses_unknown_options():
    with pytest.raises(ValueError, match=r"refine takes levels, elements.*; got 'boxs'"):
        options_of("refine", Refinement, {"boxs": []})


def test_refuses_an_invalid_line(tmp_path):
    path = tmp_path / "list.txt"
    path.write_text("0 1\n0 two\n")
    with pytest.raises(ValueError, match="line 2: needs \"level element\"; got '0 two'"):
        Refinement(elements=str(path))


def test_refuses_elements_that_do_not_exist():
    with pytest.raises(
        InputError, match="contains element 8 of level 0, where there are 8 elements"
    ):
        check_listed([np.array([8])], 8)
    with pytest.raises(InputError, match=r"element 16 of level 1, .* before have 16 children"):
        check_listed([np.array([1, 2]), np.array([16])], 8)
