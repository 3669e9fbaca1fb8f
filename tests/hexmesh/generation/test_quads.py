"""Quads of planar regions by Gmsh: grids, holes, adjacent regions, and without Gmsh."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.errors import MissingPackage
from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.generation.quads import Plane, quads

SQUARE = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [1, 2]], float)


def made(*arguments):
    try:
        [found] = quads([Plane(*arguments)])
        return found
    except MissingPackage:
        pytest.skip("Gmsh does not load")


def areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    one, two = np.moveaxis(vertices[faces[:, [2, 3]]] - vertices[faces[:, [0, 1]]], 1, 0)
    return (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2


def test_a_region_with_four_corners_is_a_grid():
    vertices, faces, region = made(SQUARE, [[[0, 4, 1, 2, 5, 3]]], [[0, 1, 2, 3]], 9.0)
    assert areas(vertices, faces) == pytest.approx(np.full(8, 0.5))
    assert (region == 0).all()


def test_holes_are_empty_and_adjacent_regions_share_vertices():
    angle = 2 * np.pi * np.arange(8) / 8
    hole = 1 + 0.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    side = np.linspace(0, 2, 5)[:4]
    outer = [(s, 0) for s in side] + [(2, s) for s in side] + [(2 - s, 2) for s in side]
    outer += [(0, 2 - s) for s in side]
    points = np.concatenate([outer, hole, [[4, 0], [4, 2]]])
    regions = [[range(16), range(23, 15, -1)], [[*range(4, 9), 25, 24]]]
    vertices, faces, region = made(points, regions, [[], []], 0.5)
    area = areas(vertices, faces)
    empty = 8 / 2 * 0.3**2 * np.sin(np.pi / 4)
    assert [area[region == k].sum() for k in (0, 1)] == pytest.approx([4 - empty, 4])
    assert len(np.unique(vertices.round(9), axis=0)) == len(vertices)
    middle = vertices[np.isclose(vertices[:, 0], 2)]
    assert np.sort(middle[:, 1]) == pytest.approx(np.linspace(0, 2, 9))  # an edge is two


def test_a_region_that_gmsh_cannot_mesh_does_not_affect_the_others():
    square = Plane(SQUARE, [[[0, 1, 2, 3]]], [[]], 9.0)
    try:
        with pytest.raises(NoBackgroundError, match="Gmsh made no quads"):
            quads([replace(square, corners=[[0, 1, 7, 8]])])
        broken, found = quads([replace(square, corners=[[0, 1, 7, 8]]), square])
    except MissingPackage:
        pytest.skip("Gmsh does not load")
    assert broken is None and len(found[1]) > 0


def test_without_gmsh_the_error_names_the_package(without_gmsh):
    with pytest.raises(MissingPackage, match=r"gmsh, which does not load; pip install"):
        quads([Plane(SQUARE, [[[0, 1, 2, 3]]], [[]], 1.0)])
