from dataclasses import replace

import numpy as np
import pytest

from polycube.analysis.boundary_sets import (
    check_names,
    check_place,
    edge_trace,
    edges_of,
    faces_of,
    mesh_edges_of,
    place_name,
    quads_of,
    sets_of_sides,
    trace,
)
from polycube.errors import InputError
from polycube.hexmesh.named_sets import ENDS
from polycube.io.hex_meshes import boundary
from polycube.registry import build
from tests.fixtures.hexmeshes import hex_ball, hex_box
from tests.fixtures.splines import box


def test_sides_of_a_box_are_where_their_names_say():
    spline = box((2, 3, 1), (3.0, 2.0, 1.0), "h2s")
    assert list(sets_of_sides(spline)) == [*ENDS, *(f"patch_{k}" for k in range(6))]
    for end, name in enumerate(ENDS):
        points = trace(spline, faces_of(spline, name)).points
        place = [0.0, (3.0, 2.0, 1.0)[end // 2]][end % 2]
        assert points[:, end // 2] == pytest.approx(np.full(len(points), place), abs=1e-14)


@pytest.mark.slow
def test_a_smooth_solid_of_one_patch_has_no_ends():
    ball = hex_ball(2)
    spline = build("spline", {"plugin": "h2s"})(boundary(ball), ball)
    assert list(sets_of_sides(spline)) == ["patch_0"]
    with pytest.raises(InputError, match=r"no boundary set 'x_min'; there are patch_0; {box"):
        faces_of(spline, "x_min")
    low = faces_of(spline, {"box": [-2, -2, -2, 2, 2, 0.1]})
    assert 0 < len(low) < len(spline.sides)
    assert trace(spline, low).points[:, 2].max() < 0.3


def test_the_sets_of_the_mesh_come_before_its_own():
    spline = box((2, 1, 1), (2.0, 1.0, 1.0), "h2s")
    named = replace(spline, sets={"x_min": np.array([3])})
    assert faces_of(named, "x_min").tolist() == [3]
    with pytest.raises(InputError, match=r"no boundary set 'x_max'; there are x_min; {box"):
        faces_of(named, "x_max")
    check_names(["x_min", {"plane": [0, 0, 1, 9]}], named.sets)


def test_faces_of_several_spellings():
    spline = box((2, 1, 1), (2.0, 1.0, 1.0), "h2s")
    top = faces_of(spline, "z_max")
    assert len(top) == 2
    for same in (int(spline.patch[top[0]]), {"plane": [0, 0, 2, 2]}, {"box": [0, 0, 1, 2, 1, 1]}):
        assert np.array_equal(faces_of(spline, same), top)
    assert len(faces_of(spline, {"box": [1, 0, 1, 2, 1, 1]})) == 1


def test_the_edge_between_two_sides():
    """Its length, the moments of its points, and its vertices in the mesh."""
    spline = box((2, 3, 1), (3.0, 2.0, 1.0))
    edge = {"edge": ["x_max", "z_min"]}
    nodes = edges_of(spline, edge)
    here = edge_trace(spline, nodes)
    assert len(nodes) == 3 and here.area * 3 / 2 @ here.points**3 == pytest.approx([54, 4, 0])
    assert here.shape @ spline.control == pytest.approx(here.points, abs=1e-14)
    mesh = hex_box((2, 3, 1), (3.0, 2.0, 1.0))
    assert mesh.vertices[mesh_edges_of(mesh, edge)[0]].mean(axis=(0, 1)) == pytest.approx([3, 1, 0])
    sides = np.union1d(quads_of(mesh, "x_max"), quads_of(mesh, "z_min"))
    assert len(quads_of(mesh, edge)) == 6 and np.isin(quads_of(mesh, edge), sides).all()
    with pytest.raises(InputError, match="no edge of x_min and x_max: the two do not touch"):
        edges_of(spline, {"edge": ["x_min", "x_max"]})
    with pytest.raises(InputError, match="no boundary set 'hole_1'"):
        check_names([{"edge": ["x_min", "hole_1"]}], sets_of_sides(spline))


def test_names_of_places():
    places = ("x_min", 7, {"plane": [1, 0, 0, 2.5]}, {"edge": ["x_min", 7]})
    assert list(map(place_name, places)) == ["x_min", "7", "plane 1 0 0 2.5", "edge of x_min and 7"]


@pytest.mark.parametrize(
    "bad",
    [
        *(None, True, 1.5, "top", "x_mid", "hole", {"box": [1]}, {"ball": [0, 0, 0, 1]}, {}),
        *({"edge": ["x_min"]}, {"edge": "x_min"}, {"edge": ["x_min", "top"]}, {"edge": 7}),
    ],
)
def test_refuses_invalid_places(bad):
    with pytest.raises(ValueError, match=r"boundary faces are a patch number, a name \(x_min to z"):
        check_place(bad)
