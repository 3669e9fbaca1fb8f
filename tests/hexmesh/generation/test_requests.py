"""Entries of meshing.at: how they are read, refused, and compared with a mesh."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.face_groups import facing, measure
from polycube.hexmesh.generation.requests import Request, requests_of
from polycube.hexmesh.generation.requests_met import check_requests, reached, unmet
from polycube.surface.measures import diagonal
from tests.fixtures.hexmeshes import hex_box, rings, surface_of
from tests.fixtures.machined import bored

BOX = hex_box((4, 3, 2), (4.0, 3.0, 2.0))
SIDES = facing(measure(BOX.vertices[BOX.quads]).normal) + 1
NAMES = ("", "", "", "WEB", "", "BOLT 1")


def cad_box():
    return surface_of(BOX, SIDES, NAMES)


def test_entries_are_read():
    found = requests_of(
        [
            {"at": "hole_1", "around": 16},
            {"at": "cad_WEB", "through": 3},
            {"at": "x_min", "size": 2},
        ]
    )
    assert found == [
        Request("hole_1", "around", 16),
        Request("cad_WEB", "through", 3),
        Request("x_min", "size", 2),
    ]
    assert requests_of([]) == []


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("hole_1", "must be a list"),
        ([{"around": 3}], "an entry of at is"),
        ([{"at": "hole_1"}], "an entry of at is"),
        ([{"at": "hole_1", "around": 8, "through": 2}], "an entry of at is"),
        ([{"at": "hole_1", "deep": 2}], "must have around, through or size; got 'deep' at hole_1"),
        ([{"at": "hole", "around": 8}], "must name an end"),
        ([{"at": "patch_1", "around": 8}], "must name an end"),
        ([{"at": 3, "around": 8}], "must name an end"),
        ([{"at": "hole_1", "around": 2}], "a whole number from 3 to 1000; got 2"),
        ([{"at": "x_min", "through": 1.5}], "a whole number from 1 to 1000; got 1.5"),
        ([{"at": "x_min", "through": True}], "a whole number from 1 to 1000; got True"),
        ([{"at": "x_min", "size": "0%"}], "the size at x_min must be a positive number"),
    ],
)
def test_invalid_entries_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        requests_of(wrong)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cad_BOLT_2", r"no face or hole 'cad_BOLT_2'; did you mean cad_BOLT_1"),
        ("hole_1", r"there are x_min, x_max, .*, cad_WEB, cad_BOLT_1, cad_face_1 to cad_face_6"),
    ],
)
def test_an_unknown_name_is_refused_with_similar_names(name, message):
    with pytest.raises(InputError, match=message) as error:
        check_requests(cad_box(), [Request(name, "size", 1)])
    assert error.value.where == "meshing.at"


def test_edges_around_a_face_without_border_are_refused():
    closed = surface_of(BOX, np.ones(len(BOX.quads), int))
    with pytest.raises(InputError, match="cad_face_1 has no border"):
        check_requests(closed, [Request("cad_face_1", "around", 8)])
    check_requests(closed, [Request("cad_face_1", "size", 8)])


def test_numbers_of_a_box():
    """Unit cubes, 4 x 3 x 2: through the face at y_max 3, round it 2 (4 + 2) edges, of length 1."""
    surface = cad_box()
    requests = [Request("cad_WEB", k, 3) for k in ("through", "around", "size")]
    assert reached(BOX, surface, requests) == [3, 12, 1]
    assert unmet(BOX, surface, requests) == []
    more = [Request("cad_WEB", "through", 4), Request("cad_WEB", "size", "10%")]
    assert unmet(BOX, surface, [*more, Request("y_max", "around", 13)]) == [
        "meshing.at: the mesh has 3 hexes through the wall at cad_WEB instead of 4",
        f"meshing.at: the mesh has edges of 1 at cad_WEB instead of {diagonal(surface) / 10:.3g}",
        "meshing.at: the mesh has 12 edges round y_max instead of 13",
    ]


def test_a_face_without_a_quad_is_reported():
    thin = replace(BOX, vertices=BOX.vertices)
    sides = SIDES.copy()
    sides[np.flatnonzero(SIDES == 4)[0]] = 7
    surface = surface_of(BOX, sides)
    coarse = hex_box((1, 1, 1), (4.0, 3.0, 2.0))
    assert reached(thin, surface, [Request("cad_face_7", "through", 1)]) == [3]
    assert unmet(coarse, surface, [Request("cad_face_7", "through", 1)]) == [
        "the mesh has no quad on cad_face_7, which meshing.at requests"
    ]


def test_half_the_wall_of_a_hole_counts_as_the_hole():
    surface = bored()
    wall = surface.region == surface.region[0]
    middle = surface.vertices[surface.faces].mean(axis=1)
    radius = np.linalg.norm(middle[:, :2], axis=1)
    wall = (radius < 1.01) & (np.ptp(surface.vertices[surface.faces][:, :, 2], axis=1) > 0)
    region = surface.region.copy()
    region[wall & (middle[:, 0] > 0)] = region.max() + 1
    halves = replace(surface, region=region)
    mesh = rings((1.0, 1.5, 2.0), n=16, height=2.0)
    half = f"cad_face_{region.max()}"
    check_requests(halves, [Request(half, "around", 16)])
    assert reached(mesh, halves, [Request(half, "around", 16)]) == [16]


def test_holes_of_a_surface_without_cad_faces_have_names():
    surface = replace(bored(), region=np.zeros(0, int))
    requests = [Request("hole_1", "around", 16), Request("z_max", "through", 1)]
    check_requests(surface, requests)
    mesh = rings((1.0, 1.5, 2.0), n=16, height=2.0)
    assert reached(mesh, surface, requests) == [16, 1]
    with pytest.raises(InputError, match="no face or hole 'cad_face_1'"):
        check_requests(surface, [Request("cad_face_1", "size", 1)])
