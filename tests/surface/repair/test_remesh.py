"""A surface built anew: closed, without crossings, near the soup, its volume the soup's."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.examples.parts import example
from polycube.surface.checks import check_surface
from polycube.surface.closest import distance, tree
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import face_normals, genus, volume
from polycube.surface.repair.remesh import remesh
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, joined


def test_overlapping_boxes_become_their_union():
    one = box()
    size = np.ptp(one.vertices, axis=0)
    other = TriMesh(one.vertices + 0.5 * size + 0.013 * size, one.faces)
    made = remesh(joined(one, other), size.min() / 12)
    check_surface(made)
    assert not len(self_intersections(made))
    overlap = 0.487**3
    assert volume(made) == pytest.approx((2 - overlap) * volume(one), rel=0.03)


def test_a_part_keeps_its_genus_volume_and_place():
    part = example("rod")
    cell = np.ptp(part.vertices, axis=0).max() / 40
    made = remesh(part, cell)
    check_surface(made)
    assert not len(self_intersections(made))
    assert genus(made) == genus(part)
    assert volume(made) == pytest.approx(volume(part), rel=0.01)
    boxes = tree(part.vertices[part.faces], face_normals(part))
    assert distance(boxes, made.vertices).max() < cell


def test_a_sheet_encloses_nothing():
    sheet = TriMesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="enclose no volume"):
        remesh(sheet, 0.1)
