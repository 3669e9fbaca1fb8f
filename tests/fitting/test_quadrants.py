"""Quadrants of hexes behind a corner of a boundary quad."""

import numpy as np
import pytest

from polycube.fitting.flat_corners import quadrant
from polycube.hexmesh.connectivity import (
    check_conforming,
    extraordinary_edges,
    hex_mesh,
    quad_sides,
)
from polycube.hexmesh.generation.sheets import has_sheet, with_sheet
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import unit_cubes


def pocketed() -> HexMesh:
    """Unit cubes, 5 x 4 x 3, with a pocket of 2 x 1 x 1 cubes in the top."""
    return hex_mesh(*unit_cubes(5, 4, 3, missing=((2, 2, 2), (3, 2, 2))))


def at_corner(mesh: HexMesh, point: tuple[float, float, float], normal: int) -> list[np.ndarray]:
    """Quadrants behind a corner, for its quads with the given normal."""
    corner = int(np.flatnonzero((mesh.vertices == point).all(axis=1))[0])
    owner, face = quad_sides(mesh)
    flat = np.ptp(mesh.vertices[mesh.quads][..., normal], axis=1) == 0
    quad = np.flatnonzero(flat & (mesh.quads == corner).any(axis=1))
    inside = [quadrant(mesh, owner[q], face[q], corner) for q in quad]
    return [each for each in inside if each is not None]


@pytest.mark.parametrize(
    ("corner", "low", "high"),
    [
        ((2, 2, 2), (2, 2), (5, 4)),
        ((4, 2, 2), (0, 2), (4, 4)),
        ((4, 3, 2), (0, 0), (4, 3)),
        ((2, 3, 2), (2, 0), (5, 3)),
    ],
)
def test_behind_the_corner_of_a_floor_are_all_hexes_on_its_side_of_both_planes(corner, low, high):
    mesh = pocketed()
    (inside,) = at_corner(mesh, corner, 2)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)[:, :2]
    assert np.array_equal(inside, ((middle > low) & (middle < high)).all(axis=1))


def test_a_sheet_adds_a_quad_at_its_corner_only():
    mesh = pocketed()
    (inside,) = at_corner(mesh, (2, 2, 2), 2)
    assert has_sheet(mesh, inside)
    cured = with_sheet(mesh, inside)
    check_conforming(cured)
    before, after = (
        np.bincount(m.quads.ravel(), minlength=len(cured.vertices)) for m in (mesh, cured)
    )
    index = {tuple(v): k for k, v in enumerate(mesh.vertices.tolist())}
    assert after[index[2, 2, 2]] == before[index[2, 2, 2]] + 1
    for other in ((4, 2, 2), (4, 3, 2), (2, 3, 2)):
        assert after[index[other]] == before[index[other]]
    inner, _ = extraordinary_edges(cured)
    assert len(inner) == 4  # two columns of edges, from the floor to the bottom


def test_an_outer_corner_has_no_quadrant():
    assert at_corner(pocketed(), (0, 0, 3), 2) == []


def test_faces_that_end_at_an_irregular_edge_do_not_divide_the_mesh():
    mesh = pocketed()
    (inside,) = at_corner(mesh, (2, 2, 2), 2)
    cured = with_sheet(mesh, inside)
    owner, face = quad_sides(cured)
    corner = int(np.flatnonzero((cured.vertices == (2, 2, 2)).all(axis=1))[0])
    floor = np.flatnonzero(
        (cured.quads == corner).any(axis=1) & (cured.vertices[cured.quads][..., 2] == 2).all(axis=1)
    )
    assert len(floor) > 0
    assert all(quadrant(cured, owner[q], face[q], corner) is None for q in floor)
