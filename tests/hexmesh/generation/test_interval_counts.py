"""Parts of lattice intervals for requested numbers, on polycubes that are their own part."""

import numpy as np
import pytest

from polycube.hexmesh.generation.interval_counts import (
    Lattice,
    demands,
    least_demands,
    raised,
    with_demands,
)
from polycube.hexmesh.generation.requests import Request
from polycube.hexmesh.generation.requests_met import reached
from polycube.hexmesh.generation.template import mesh
from polycube.structure.rough_map import affine_map
from polycube.types import Polycube
from tests.fixtures.hexmeshes import surface_of
from tests.fixtures.polycubes import ring

PLENTY = 10**6


def i_beam():
    """I-beam: flanges and web of thickness 1, 4 high, 5 wide and 8 long."""
    full = np.ones((3, 3, 1), bool)
    full[[0, 2], 1] = False
    return Polycube(full, [0, 2, 3, 5], [0, 1, 4, 5], [0, 8], (1, 1, 1), ("cube",))


def placed(polycube, scale=1.0):
    """The map, two parts of each interval, and the surface, each plane of it a CAD face."""
    where = affine_map(polycube, scale * np.eye(3), np.zeros(3))
    few = tuple(np.full(n, 2) for n in polycube.occupancy.shape)
    near = mesh(polycube, where, few)
    return where, few, near, surface_of(near, 1 + near.patch)


def parts_of(polycube, *requests, more=(), most=PLENTY, scale=1.0):
    """Parts for some requests, and the numbers that the mesh has."""
    where, few, near, surface = placed(polycube, scale)
    found = demands(Lattice(polycube, near, few), surface, requests, more)
    parts = with_demands(polycube, few, found, most)
    has = reached(mesh(polycube, where, parts), surface, requests)
    return [number.tolist() for number in parts], has


def face(polycube, place):
    """Name of the face that a point lies on."""
    _, _, near, _ = placed(polycube)
    middle = near.vertices[near.quads].mean(axis=1)
    quad = np.linalg.norm(middle - place, axis=1).argmin()
    return f"cad_face_{1 + near.patch[quad]}"


@pytest.mark.parametrize("number", [1, 2, 3, 7])
def test_a_wall_gets_the_requested_number_of_hexes(number):
    beam = i_beam()
    web = face(beam, (2, 2.5, 4))
    parts, has = parts_of(beam, Request(web, "through", number))
    assert has == [number]
    assert parts == [[2, number, 2], [2, 2, 2], [2]]  # and no other interval changes


def test_the_wall_of_a_flange_is_its_thickness_not_the_web():
    beam = i_beam()
    top = face(beam, (1, 5, 4))
    parts, has = parts_of(beam, Request(top, "through", 3))
    assert has == [3]
    assert parts == [[2, 2, 2], [2, 2, 3], [2]]


@pytest.mark.parametrize(
    ("number", "expected"),
    [(4, 4), (8, 8), (9, 10), (10, 10), (16, 16), (18, 18), (19, 20), (40, 40)],
)
def test_edges_round_a_square_hole_are_even(number, expected):
    parts, has = parts_of(ring(), Request("hole_1", "around", number))
    assert has == [expected]
    assert 2 * (parts[0][1] + parts[1][1]) == expected
    assert abs(parts[0][1] - parts[1][1]) <= 1
    assert [parts[0][0], parts[0][2], *parts[2]] == [2, 2, 2]


def test_a_longer_side_gets_more_of_the_edges():
    slot = ring()
    slot = Polycube(slot.occupancy, [0, 1, 4, 5], [0, 1, 2, 3], [0, 1], (1, 1, 1), ("cube",))
    parts, has = parts_of(slot, Request("hole_1", "around", 16))
    assert has == [16] and (parts[0][1], parts[1][1]) == (6, 2)


def test_edges_on_a_face_have_the_requested_size():
    beam = i_beam()
    web = face(beam, (2, 2.5, 4))
    parts, has = parts_of(beam, Request(web, "size", 5.0), scale=10.0)
    assert parts == [[2, 2, 2], [2, 6, 2], [16]]  # 30 high and 80 long
    assert has == [pytest.approx(5.0)]


def test_layers_of_later_stages_are_subtracted():
    beam = i_beam()
    web = face(beam, (2, 2.5, 4))
    parts, _ = parts_of(beam, Request(web, "through", 5), more=[-2])
    assert parts[0] == [2, 3, 2]
    parts, _ = parts_of(beam, Request(web, "through", 2), more=[-2])
    assert parts[0] == [2, 1, 2]  # a hex must be left


def test_several_requests_are_all_met():
    beam = i_beam()
    web, top = face(beam, (2, 2.5, 4)), face(beam, (1, 5, 4))
    requested = [Request(web, "through", 3), Request(top, "through", 4), Request(top, "around", 30)]
    parts, has = parts_of(beam, *requested)
    assert has[:2] == [3, 4] and has[2] >= 30
    assert parts[0][1] == 3 and parts[1][2] == 4


def test_max_hexes_limits_the_requested_numbers():
    parts, has = parts_of(ring(), Request("hole_1", "around", 100), most=150)
    full = ring().occupancy[:, :, 0].astype(float)
    assert 100 < np.array(parts[0]) @ full @ np.array(parts[1]) * parts[2][0] <= 150
    assert 8 < has[0] < 100


@pytest.mark.parametrize(
    ("polycube", "expected"),
    [(i_beam(), [[2, 3, 2], [3, 2, 3], [3]]), (ring(), [[3, 6, 3], [3, 6, 3], [3]])],
)
def test_all_walls_and_holes_get_the_smallest_numbers(polycube, expected):
    _, few, near, surface = placed(polycube)
    requested = least_demands(Lattice(polycube, near, few), surface, 3, lambda length: 24)
    parts = raised(polycube, few, requested, PLENTY)
    assert [number.tolist() for number in parts] == expected


def test_a_number_at_a_face_has_precedence_but_a_length_has_not():
    beam = i_beam()
    _, few, near, surface = placed(beam)
    web, side = face(beam, (2, 2.5, 4)), face(beam, (5, 0.5, 4))
    requests = [Request(web, "through", 1), Request(side, "size", 1.0)]
    lattice = Lattice(beam, near, few)
    requested = demands(lattice, surface, requests)
    parts = with_demands(beam, few, requested, PLENTY)
    assert [number.tolist() for number in parts] == [[2, 1, 2], [1, 2, 2], [8]]
    least = least_demands(lattice, surface, 2, 8, requested)
    parts = raised(beam, parts, least, PLENTY)
    assert [number.tolist() for number in parts] == [[2, 1, 2], [2, 2, 2], [8]]
