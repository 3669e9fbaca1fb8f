import numpy as np
import pytest

from polycube.errors import InputError
from polycube.geometry.hexes import hex_mesh
from polycube.io.hexes import boundary
from polycube.registry import build
from polycube.spline.patches import ENDS, check_place, faces_of, patch_names, place_name
from polycube.spline.trace import trace
from tests.hex_solids import hex_ball, hex_box
from tests.spline.spaces import box, spline_of


def test_sides_of_a_box_are_where_their_names_say():
    spline = box((2, 3, 1), (3.0, 2.0, 1.0), "h2s")
    names = patch_names(spline)
    assert list(names) == list(ENDS)
    assert sorted(number for own in names.values() for number in own) == list(range(6))
    for end, name in enumerate(ENDS):
        points = trace(spline, faces_of(spline, name)).points
        place = [0.0, (3.0, 2.0, 1.0)[end // 2]][end % 2]
        assert points[:, end // 2] == pytest.approx(np.full(len(points), place), abs=1e-14)


def without_middle(layers):
    """Box of 3 x 3 x layers hexes, the middle one on top taken out."""
    whole = hex_box((3, 3, layers), (3.0, 3.0, layers))
    middle = whole.vertices[whole.hexes].mean(axis=1)
    kept = whole.hexes[~np.isclose(middle, [1.5, 1.5, layers - 0.5]).all(axis=1)]
    return hex_mesh(*used_by(whole, kept))


def used_by(mesh, hexes):
    used, local = np.unique(hexes, return_inverse=True)
    return mesh.vertices[used], local.reshape(-1, 8)


@pytest.mark.parametrize(("layers", "walls"), [(1, 4), (2, 5)], ids=["hole", "pocket"])
def test_walls_of_a_hole_and_of_a_pocket(layers, walls):
    spline = spline_of(without_middle(layers), "h2s")
    names = patch_names(spline)
    assert set(names) == {*ENDS, "hole_1"}
    assert len(names["hole_1"]) == walls
    inside = np.setdiff1d(spline.patch, np.concatenate([names[end] for end in ENDS]))
    assert sorted(names["hole_1"]) == inside.tolist()


def test_an_inner_angle_is_no_hole():
    whole = hex_box((2, 2, 1))
    spline = spline_of(hex_mesh(*used_by(whole, whole.hexes[:3])), "h2s")
    assert len(np.unique(spline.patch)) == 8
    assert set(patch_names(spline)) == set(ENDS)


def test_a_smooth_solid_of_one_patch_has_no_ends():
    ball = hex_ball(2)
    spline = build("spline", {"plugin": "h2s"})(boundary(ball), ball)
    assert patch_names(spline) == {}
    with pytest.raises(InputError, match=r"no boundary patch 'x_min'; there are number 0; {box"):
        faces_of(spline, "x_min")
    low = faces_of(spline, {"box": [-2, -2, -2, 2, 2, 0.1]})
    assert 0 < len(low) < len(spline.sides)
    assert trace(spline, low).points[:, 2].max() < 0.3


def test_faces_of_several_spellings():
    spline = box((2, 1, 1), (2.0, 1.0, 1.0), "h2s")
    top = faces_of(spline, "z_max")
    assert len(top) == 2
    for same in (int(spline.patch[top[0]]), {"plane": [0, 0, 2, 2]}, {"box": [0, 0, 1, 2, 1, 1]}):
        assert np.array_equal(faces_of(spline, same), top)
    assert len(faces_of(spline, {"box": [1, 0, 1, 2, 1, 1]})) == 1


def test_places_in_words():
    assert [place_name(place) for place in ("x_min", 7, {"plane": [1, 0, 0, 2.5]})] == [
        "x_min",
        "7",
        "plane 1 0 0 2.5",
    ]


@pytest.mark.parametrize("bad", [None, True, 1.5, {"box": [1]}, {"ball": [0, 0, 0, 1]}, {}])
def test_refuses_what_is_no_place(bad):
    with pytest.raises(ValueError, match="boundary faces are a patch number, a name such as x_min"):
        check_place(bad)
