"""Blocks divided into hexes: numbers, positions and patches are known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import check_conforming, hex_mesh
from polycube.hexmesh.generation import blocks
from polycube.hexmesh.quality import volume
from tests.fixtures.hexmeshes import hex_box, hex_cylinder


def test_a_box_is_cut_into_parts_of_the_size():
    box = hex_box((1, 1, 1), (4.0, 2.0, 1.0))
    parts = blocks.counts(box, 0.5)
    assert parts.tolist() == [[8, 4, 2]]
    assert blocks.number_of_hexes(parts) == 64
    found, expected = blocks.cut(box, parts), hex_box((8, 4, 2), (4.0, 2.0, 1.0))
    assert {*map(tuple, found.vertices.round(9))} == {*map(tuple, expected.vertices.round(9))}
    assert len(found.hexes) == 64 and len(found.vertices) == 9 * 5 * 3
    check_conforming(found)


def test_opposite_edges_of_all_blocks_in_a_row_have_equal_parts():
    row = hex_box((3, 1, 1), (3.0, 1.0, 1.0))
    longer = np.where(row.vertices[:, :1] == 3, row.vertices * [1, 4, 1], row.vertices)
    stretched = replace(row, vertices=longer)
    # along y three edges are 1 and one is 4: 1.75 on average, but none may be above 1.4 sizes
    assert blocks.counts(stretched, 1.0)[:, 1].tolist() == [3, 3, 3]
    check_conforming(blocks.cut(stretched, blocks.counts(stretched, 1.0)))


@pytest.mark.parametrize("size", [0.2, 0.5])
def test_irregular_blocks_are_conforming_and_preserve_volume_patches_and_cells(size):
    tube = hex_cylinder()
    patch = np.arange(len(tube.quads))
    tube = replace(tube, patch=patch, cell=np.arange(len(tube.hexes)))
    parts = blocks.counts(tube, size)
    found = blocks.cut(tube, parts)
    check_conforming(found)
    assert len(found.hexes) == blocks.number_of_hexes(parts)
    assert volume(found) == pytest.approx(volume(tube))
    assert np.bincount(found.cell).tolist() == parts.prod(axis=1).tolist()
    for number in patch:
        quads = found.quads[found.patch == number]
        corners = found.vertices[quads].reshape(-1, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        own = tube.vertices[tube.quads[number]]
        assert (low, high) == (pytest.approx(own.min(axis=0)), pytest.approx(own.max(axis=0)))


def test_an_undivided_block_is_unchanged():
    box = hex_box((1, 1, 1))
    found = blocks.cut(box, np.ones((1, 3), int))
    np.testing.assert_allclose(found.vertices[found.hexes], box.vertices[box.hexes])
    np.testing.assert_array_equal(found.patch.shape, box.patch.shape)


def test_vertices_are_projected_radially_to_the_unit_cube():
    octahedron = np.concatenate([np.eye(3), -np.eye(3)]) * [1, 2, 4] + 7
    found = blocks.on_box(octahedron)
    assert found.tolist() == pytest.approx((np.concatenate([np.eye(3), -np.eye(3)]) + 1) / 2)
    face = np.array([[1 / 3, 2 / 3, 4 / 3]]) + 7
    assert blocks.on_box(np.concatenate([octahedron, face]))[-1] == pytest.approx([1, 1, 1])


def test_the_division_does_not_depend_on_the_position():
    tube = hex_cylinder()
    parts = blocks.counts(tube, 0.4)
    here = blocks.cut(tube, parts)
    far = blocks.cut(hex_mesh(tube.vertices * 1e-3 + 5, tube.hexes), parts)
    np.testing.assert_array_equal(here.hexes, far.hexes)
