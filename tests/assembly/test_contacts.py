"""Faces that touch, with the area of the contact."""

import numpy as np
import pytest

from polycube.assembly.contacts import contacts
from polycube.types import TriMesh

SIDES = np.array(
    [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
)


def box(low, high, turn=None):
    """Box with CAD faces 1 to 6: -x, +x, -y, +y, -z, +z."""
    base = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    corners = np.concatenate([base, base + np.array([0, 0, 1])])
    points = np.asarray(low) + corners * np.subtract(high, low)
    faces = SIDES[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return TriMesh(
        points if turn is None else points @ turn.T, faces, np.repeat(np.arange(1, 7), 2)
    )


def tube(inner, outer, height, segments, phase=0.0):
    """Tube round z; face 1 outside, 2 inside (none for inner=0), 3 below, 4 above."""
    angle = 2 * np.pi * (np.arange(segments) + phase) / segments
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = [
        np.column_stack([radius * ring, np.full(segments, z)])
        for radius in (outer, inner)
        for z in (0.0, height)
    ]
    a, b = np.arange(segments), np.roll(np.arange(segments), -1)

    def wall(low, high):
        low, high = segments * low, segments * high
        return np.concatenate(
            [np.stack([low + a, low + b, high + b], 1), np.stack([low + a, high + b, high + a], 1)]
        )

    walls = [wall(0, 1), wall(3, 2), wall(2, 0), wall(1, 3)]
    region = np.repeat([1, 2, 3, 4], 2 * segments)
    vertices, faces = np.concatenate(points), np.concatenate(walls)
    if inner == 0:  # the inner rings are points
        vertices = np.concatenate([vertices[: 2 * segments], [[0, 0, 0], [0, 0, height]]])
        faces = np.where(faces >= 2 * segments, 2 * segments + faces // segments - 2, faces)
        has_area = (np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)
        faces, region = faces[has_area], region[has_area]
    return TriMesh(vertices, faces, region)


def test_boxes_side_by_side_share_a_side():
    [found] = contacts(box([0, 0, 0], [2, 3, 4]), box([2, 0, 0], [5, 3, 4]))
    assert (found.first, found.second) == (2, 1)
    assert found.area == pytest.approx(12) and found.share == pytest.approx(1)


@pytest.mark.parametrize("seed", range(3))
def test_the_area_of_a_contact_is_that_of_the_overlap_in_any_place(seed):
    """Boxes of which each covers a part of the other's side, turned together."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    low, high = rng.uniform(0, 1, 2), rng.uniform(1.5, 3, 2)
    second = box([*low, 1], [*high, 2], turn)
    [found] = contacts(box([0, 0, 0], [2, 1.4, 1], turn), second)
    overlap = (np.minimum(high, [2, 1.4]) - low).prod()
    assert (found.first, found.second) == (6, 5)
    assert found.area == pytest.approx(overlap)
    assert found.share == pytest.approx(overlap / min(2.8, (high - low).prod()))


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ([1.001, 0, 0], [2, 1, 1]),  # a gap
        ([1, 1, 0], [2, 2, 1]),  # an edge
        ([0.5, 0, 0], [1, 1, 1]),  # one inside of the other, faces that look the same way
        ([0.9, 0.2, 0.2], [1.5, 0.8, 0.8]),  # they cross
    ],
)
def test_what_does_not_touch_face_to_face_has_no_contact(low, high):
    assert contacts(box([0, 0, 0], [1, 1, 1]), box(low, high)) == []


def test_a_small_gap_is_a_contact():
    [found] = contacts(box([0, 0, 0], [1, 1, 1]), box([1 + 1e-5, 0, 0], [2, 1, 1]))
    assert found.area == pytest.approx(1)


@pytest.mark.parametrize(("segments", "phase"), [(48, 0), (48, 0.4), (32, 0.3)])
def test_a_pin_fills_its_hole(segments, phase):
    """However the triangles of both lie: the area is that of the wall."""
    found = contacts(tube(5, 12, 10, 48), tube(0, 5, 25, segments, phase))
    assert [(each.first, each.second) for each in found] == [(2, 1)]
    assert found[0].area == pytest.approx(2 * np.pi * 5 * 10, rel=0.01)


def test_a_loose_pin_does_not_touch_its_hole():
    assert contacts(tube(5, 12, 10, 48), tube(0, 4.9, 10, 48)) == []


def test_a_pin_standing_on_a_plate_touches_it_with_its_end():
    [found] = contacts(box([-20, -20, -5], [20, 20, 0]), tube(0, 5, 25, 48))
    assert (found.first, found.second) == (6, 3)
    assert found.area == pytest.approx(48 / 2 * 25 * np.sin(2 * np.pi / 48))


def test_a_pin_lying_on_a_plate_touches_it_in_a_line_which_is_no_contact():
    pin = tube(0, 5, 25, 48, phase=0.5)
    lying = TriMesh(pin.vertices[:, [2, 0, 1]], pin.faces, pin.region)
    low = lying.vertices[:, 2].min()
    assert contacts(box([-20, -20, -5], [40, 20, low]), lying) == []
