import logging

import numpy as np
import pytest

from polycube.charts.charts import flatten, plane_of, settle
from polycube.charts.harmonic import flipped
from polycube.charts.segmentation import segment
from polycube.charts.tracing import Drawing
from polycube.structure.lattice import boundary
from polycube.types import Parametrization, TriMesh
from tests.fixtures.charts import given, ring, sheet
from tests.fixtures.surfaces import torus


def folds(found, polycube) -> int:
    """Triangles of a flat sheet that are clockwise, or not in the plane of their patch."""
    outside, number = boundary(polycube), 0
    for patch in range(outside.patch.max() + 1):
        quads = outside.vertices[outside.quads[outside.patch == patch]]
        axis = int(outside.axis[(outside.patch == patch).argmax()])
        faces = found.faces[found.tag == patch]
        number += int(flipped(found.places[:, plane_of(axis)], faces).sum())
        off = found.places[faces][..., axis // 2] - quads[0, 0, axis // 2]
        number += int((np.abs(off) > 1e-12).sum())
    return number


@pytest.mark.parametrize("context", [("cube", "cube"), ("hole_y", "hole_x"), ("cube", "hole_z")])
def test_a_sheared_polycube_is_flattened_onto_itself(context):
    """Its charts are linear, so the harmonic maps are exact, also those of rings."""
    surface, polycube, labels, places = given(context)
    pieces = segment(surface, polycube, labels, Parametrization(places), 0.1)
    before = pieces.drawing.sheet
    found = flatten(pieces)
    np.testing.assert_array_equal(found.faces, before.faces)
    np.testing.assert_allclose(found.places, before.places, atol=1e-9)
    assert folds(found, polycube) == 0


def test_a_round_ring_is_flattened_one_to_one(caplog):
    surface, polycube, labels, places = ring()
    with caplog.at_level(logging.INFO):
        found = flatten(segment(surface, polycube, labels, places, 0.05))
    assert folds(found, polycube) == 0
    flat = TriMesh(found.places, found.faces)
    corners = flat.vertices[flat.faces]
    area = np.linalg.norm(np.cross(*(corners[:, k] - corners[:, 0] for k in (1, 2))), axis=1).sum()
    np.testing.assert_allclose(area / 2, 4 + 4 / 3 + 2 * 8 / 9)  # it covers the polycube once


def test_a_patch_that_folds_is_cut_into_rectangles(caplog):
    """Positions on one rim are shifted by half a side: the harmonic map of the ring folds."""
    surface, polycube, labels, places = ring()
    x, y, z = places.positions.T
    twist = np.pi / 5 * (np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) < 0.3)
    angle = np.arctan2(surface.vertices[:, 1], surface.vertices[:, 0]) + twist
    flat = np.stack([np.cos(angle), np.sin(angle)])
    radius = np.maximum(np.abs(x - 0.5), np.abs(y - 0.5))
    flat *= radius / np.abs(flat).max(axis=0)
    turned = Parametrization(np.stack([*(0.5 + flat), z], axis=1))
    with caplog.at_level(logging.INFO):
        found = flatten(segment(surface, polycube, labels, turned, 0.05))
    assert "triangles flipped, none after a division into rectangles" in caplog.text
    assert folds(found, polycube) == 0


def test_knots_are_between_their_guided_and_even_positions():
    pen = Drawing(sheet(torus(60, 12)), ())
    pen.paths[0] = np.arange(31) * 12  # half way round the outer circle
    share = np.linspace(0, 1, 31) ** 2
    knots = np.array([[0, 0, 0], [0, 0.25, 0], [0, 1, 0]])
    noise = 0.02 * np.random.default_rng(0).standard_normal(31)
    pen.move(pen.paths[0], np.stack([noise, share + noise, noise], axis=1))
    stops = settle(pen, 0, knots)
    wanted = round(30 * (0.3 * 0.25 + 0.7 * 0.5))
    assert abs(list(pen.paths[0]).index(stops[1]) - wanted) <= 1
    np.testing.assert_array_equal(stops[[0, 2]], pen.paths[0][[0, -1]])
    np.testing.assert_allclose(pen.sheet.places[stops], knots, atol=1e-12)
    assert (np.diff(pen.sheet.places[pen.paths[0], 1]) > 0).all()


def test_close_knots_get_separate_vertices():
    pen = Drawing(sheet(torus(60, 12)), ())
    pen.paths[0] = np.arange(7) * 12
    pen.move(pen.paths[0], np.zeros((7, 3)))  # no guidance at all
    knots = np.array([[0, 0, t] for t in (0, 0.97, 0.98, 0.99, 1)])
    assert len(set(settle(pen, 0, knots).tolist())) == 5


@pytest.mark.parametrize("axis", range(6))
def test_the_plane_of_a_face_is_right_handed_from_outside(axis):
    first, second = np.eye(3)[plane_of(axis)]
    outward = np.eye(3)[axis // 2] * (1 - 2 * (axis % 2))
    np.testing.assert_array_equal(np.cross(first, second), outward)
