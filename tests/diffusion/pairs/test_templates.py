"""Contexts of a grid and their tessellated surfaces."""

import numpy as np
import pytest

from polycube.diffusion.pairs.templates import SMOOTHING, contexts, template
from polycube.structure.lattice import genus, is_manifold, lattice
from polycube.surface.measures import genus as surface_genus
from polycube.surface.measures import volume
from polycube.types import TriMesh


def test_the_paper_has_24_contexts(primitives: dict) -> None:
    found = contexts((2, 1, 1), primitives)
    assert len(found) == 24 == len(set(found))
    assert (None, None) not in found


def test_voids_and_pieces_are_left_out(primitives: dict) -> None:
    found = contexts((3, 1, 1), primitives)
    assert ("cube", None, "cube") not in found  # two pieces
    assert ("cube", "hole_x", "cube") not in found  # the hole is closed at both ends
    assert ("cube", "hole_y", "cube") in found


def test_pinched_solids_are_left_out(primitives: dict) -> None:
    assert ("cube", None, None, "cube") not in contexts((2, 2, 1), primitives)  # along an edge
    pinched = [None] * 8
    pinched[0] = pinched[1] = pinched[3] = pinched[7] = "cube"  # a path from corner to corner
    assert tuple(pinched) in contexts((2, 2, 2), {"cube": primitives["cube"]})
    pinched[1], pinched[3] = None, None
    assert tuple(pinched) not in contexts((2, 2, 2), {"cube": primitives["cube"]})


@pytest.mark.parametrize("grid", [(3, 2, 1), (2, 2, 2)])
def test_large_grids_have_a_reproducible_subset_of_contexts(grid: tuple, primitives: dict) -> None:
    found = contexts(grid, primitives, limit=100)
    assert found == contexts(grid, primitives, limit=100)
    assert len(found) == 100 == len(set(found))
    assert all(is_manifold(lattice(grid, context, primitives)) for context in found)
    assert any(set(context) == {"cube", None} for context in found)  # L, T or U
    assert any(len(set(context)) > 2 for context in found)


def test_labels_of_a_cube_with_a_holed_neighbour(primitives: dict) -> None:
    shape = template((2, 1, 1), ("cube", "hole_z"), primitives)
    axis, cell, wall = shape.axis, shape.cell, shape.wall
    a, b, c = shape.vertices[shape.faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    outward = np.concatenate([np.eye(3), -np.eye(3)])[axis % 2 * 3 + axis // 2]
    assert np.allclose(normal / np.linalg.norm(normal, axis=1)[:, None], outward)
    area = np.linalg.norm(normal, axis=1) / 2
    assert area[(cell == 0) & (wall == 0)].sum() == pytest.approx(5)  # the sixth face is glued
    assert area[(cell == 0) & (wall == 1)].sum() == pytest.approx(0)
    assert area[(cell == 1) & (wall == 0)].sum() == pytest.approx(5 - 2 / 9)
    assert area[(cell == 1) & (wall == 1)].sum() == pytest.approx(4 / 3)  # the hole's four walls
    assert set(axis[wall == 1]) == {0, 1, 2, 3}


def test_the_bottom_of_a_blind_hole_is_a_wall_of_the_cell_behind(primitives: dict) -> None:
    shape = template((2, 1, 1), ("cube", "hole_x"), primitives)
    bottom = (shape.wall == 1) & (shape.cell == 0)
    assert set(shape.axis[bottom]) == {0}  # +x, seen through the hole
    assert np.allclose(shape.vertices[shape.faces[bottom]][:, :, 0], 0)


def test_the_inner_corner_of_an_l_is_outer_wall(primitives: dict) -> None:
    shape = template((2, 2, 1), ("cube", "cube", "cube", None), primitives)
    assert not shape.wall.any()
    areas = [
        np.bincount(shape.axis[shape.cell == cell], minlength=6).tolist() for cell in (0, 1, 2)
    ]
    face = 2 * 12**2  # triangles on a face of a cell: 3 voxels of 4 steps
    assert areas == [
        [0, face, 0, face, face, face],
        [face, face, face, 0, face, face],
        [face, 0, face, face, face, face],
    ]


@pytest.mark.parametrize(
    ("context", "cells"),
    [(("cube", None), 1), (("hole_x", "cube"), 51 / 27), (("hole_y", "hole_z"), 48 / 27)],
)
def test_surface_has_the_genus_and_volume_of_the_polycube(
    context: tuple, cells: float, primitives: dict
) -> None:
    shape = template((2, 1, 1), context, primitives)
    surface = TriMesh(shape.vertices, shape.faces)
    assert surface_genus(surface) == genus(shape.polycube)
    assert volume(surface) == pytest.approx(cells)
    assert shape.vertices.min(axis=0)[0] == (-1 if context[0] else 0)


def test_rounding_keeps_the_box_and_makes_the_surface_smoother(primitives: dict) -> None:
    shape = template((2, 1, 1), ("hole_z", "cube"), primitives)
    assert shape.rounded.shape == (len(SMOOTHING), *shape.vertices.shape)
    assert np.allclose(shape.rounded[0], shape.vertices)
    lengths = []
    for vertices in shape.rounded:
        assert vertices.min(axis=0) == pytest.approx(shape.vertices.min(axis=0))
        assert vertices.max(axis=0) == pytest.approx(shape.vertices.max(axis=0))
        corner = np.linalg.norm(vertices - np.array([-1, -0.5, -0.5]), axis=1).min()
        lengths.append(corner)
    assert (np.diff(lengths) > 0).all()  # corners retreat further and further
