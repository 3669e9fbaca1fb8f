"""Sheets of hexes around a set of hexes."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from polycube.hexmesh import connectivity as hexes
from polycube.hexmesh.generation.sheets import has_sheet, with_sheet
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.types import HexMesh, Polycube
from tests.fixtures.polycubes import cut

SIDE = 4


def cube() -> HexMesh:
    """Unit cube of 4 x 4 x 4 hexes; patches +x, -x, +y, -y, +z, -z."""
    solid = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    return cut(solid, 1 / SIDE)


def chosen(mesh: HexMesh, low: tuple[int, int, int], high: tuple[int, int, int]) -> np.ndarray:
    """(H,) hexes of a box of them, from the numbers `low` up to before `high`."""
    middle = mesh.vertices[mesh.hexes].mean(axis=1) * SIDE
    return ((middle > low) & (middle < high)).all(axis=1)


@pytest.mark.parametrize(
    ("low", "high", "more"),
    [
        ((1, 1, 1), (2, 2, 2), 6),  # inside
        ((1, 1, 3), (2, 2, 4), 5),  # under a face
        ((0, 0, 0), (1, 1, 1), 3),  # at a corner
        ((1, 1, 2), (3, 3, 4), 4 + 8 + 4 + 4),  # two layers under four quads
        ((0, 0, 3), (4, 4, 4), 16),  # a whole layer
    ],
)
def test_a_sheet_has_a_hex_for_each_face_between_set_and_rest(low, high, more):
    mesh = cube()
    inside = chosen(mesh, low, high)
    assert has_sheet(mesh, inside)
    after = with_sheet(mesh, inside)
    hexes.check_conforming(after)
    assert len(after.hexes) == 64 + more
    assert scaled_jacobian(after.vertices, after.hexes).min() > 0.3
    at_edge = (np.array(low) == 0).any()  # edges of the cube between the set and others are cut
    assert (0.98 if at_edge else 1 - 1e-12) < volume(after) < 1 + 1e-12


def test_quads_of_the_sheet_belong_to_the_patch_of_the_set():
    mesh = cube()
    after = with_sheet(mesh, chosen(mesh, (1, 1, 3), (3, 3, 4)))
    corners = after.vertices[after.quads]
    for patch, (axis, place) in enumerate([(0, 1), (0, 0), (1, 1), (1, 0), (2, 1), (2, 0)]):
        assert corners[after.patch == patch][..., axis] == pytest.approx(place)
    assert np.bincount(after.patch).tolist() == [16, 16, 16, 16, 24, 16]


def test_vertices_outside_the_set_do_not_move():
    mesh = cube()
    inside = chosen(mesh, (1, 1, 3), (3, 3, 4))
    after = with_sheet(mesh, inside)
    assert np.array_equal(after.vertices[: len(mesh.vertices)], mesh.vertices)
    assert np.array_equal(after.hexes[:64][~inside], mesh.hexes[~inside])


def test_sets_pinched_at_an_edge_or_a_vertex_have_no_sheet():
    mesh = cube()
    one = chosen(mesh, (1, 1, 1), (2, 2, 2))
    neighbour = chosen(mesh, (2, 2, 1), (3, 3, 2))  # shares an edge
    on_top = chosen(mesh, (1, 1, 3), (2, 2, 4)) | chosen(mesh, (2, 2, 3), (3, 3, 4))
    assert not has_sheet(mesh, one | neighbour)
    assert not has_sheet(mesh, on_top)
    assert not has_sheet(mesh, np.zeros(64, bool))
    assert not has_sheet(mesh, np.ones(64, bool))


@pytest.mark.slow
@given(st.lists(st.integers(0, 63), min_size=1, max_size=20, unique=True))
def test_any_set_that_may_have_a_sheet_gives_a_conforming_mesh(numbers):
    mesh = cube()
    inside = np.zeros(64, bool)
    inside[numbers] = True
    assume(has_sheet(mesh, inside))
    after = with_sheet(mesh, inside)
    hexes.check_conforming(after)
    assert hexes.genus(after) == 0
    assert len(after.hexes) > 64


def test_hexes_that_meet_at_one_inner_vertex_have_no_sheet():
    mesh = cube()
    assert not has_sheet(
        mesh, chosen(mesh, (1, 1, 1), (2, 2, 2)) | chosen(mesh, (2, 2, 2), (3, 3, 3))
    )
    assert has_sheet(mesh, chosen(mesh, (1, 1, 1), (3, 2, 2)))
