"""Edges and corners sharper than a hex can follow, on wedges whose angles are known."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from polycube.pipeline.intake import sharp_places
from polycube.surface.curves.acute import SHARP, acute
from polycube.surface.measures import corner_angles
from tests.fixtures.surfaces import wedge


@settings(deadline=None)
@given(
    st.floats(2, 80).filter(lambda each: abs(each - 20) > 1e-6),
    st.floats(1e-3, 1e3),
    st.integers(0, 100),
)
@pytest.mark.slow
def test_a_wedge_has_one_edge_and_two_corners(degrees, size, seed):
    angle = np.deg2rad(degrees)
    assume(abs(angle - SHARP) > 1e-9)  # at the limit itself, rounding decides
    found = acute(wedge(angle, size=size, seed=seed))
    if angle > SHARP:
        assert not found
        return
    assert [each.angle for each in found] == pytest.approx([angle] * 3, abs=1e-6)
    assert sorted((each.kind, each.faces) for each in found) == [
        ("corner", (1,)),
        ("corner", (2,)),
        ("edge", (3, 5)),
    ]
    ends = wedge(angle, size=size, seed=seed).vertices[[0, 3]]
    for each in found:
        at = {1: ends[0], 2: ends[1]}.get(each.faces[0], ends.mean(axis=0))
        assert each.place == pytest.approx(at, abs=1e-9 * size)


def test_without_cad_faces_edges_alone_are_found():
    found = acute(wedge(np.deg2rad(10), with_faces=False))
    assert [(each.kind, each.faces) for each in found] == [("edge", (0,))]


def test_the_sharpest_place_is_named_with_what_it_bounds():
    (sentence,) = sharp_places(wedge(np.deg2rad(10)))
    assert sentence.startswith("1 edge and 2 corners of the part are sharper than 20 degrees")
    assert "10.0 degrees" in sentence and "scaled Jacobian of 0.17 at most" in sentence
    assert "cad_face_" in sentence
    assert sharp_places(wedge(np.deg2rad(30))) == []


def test_angles_of_a_triangle_add_up_to_two_right_angles():
    surface = wedge(np.deg2rad(10))
    angles = corner_angles(surface)
    assert angles.sum(axis=1) == pytest.approx(np.pi)
    assert angles[0] == pytest.approx(np.deg2rad([10, 85, 85]))
