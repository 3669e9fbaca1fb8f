"""Blocks divided into hexes: numbers, positions and patches are known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.errors import MeshingError
from polycube.hexmesh.connectivity import check_conforming, hex_mesh
from polycube.hexmesh.generation import blocks
from polycube.hexmesh.quality import volume
from polycube.plugins.ranking.registration import Registration
from polycube.registry import build
from polycube.types import HexMesh, Tier
from tests.fixtures.hexmeshes import hex_box, hex_cylinder
from tests.fixtures.surfaces import box


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


def test_blocks_use_size_and_max_hexes_and_warn_about_regions():
    surface, given = box(), hex_box((2, 2, 2))
    candidate = blocks.candidate(given, surface, "cube", "mine")
    assert (candidate.tier, candidate.variants) == (Tier.COARSE, "blocks")

    def hexes(**options) -> HexMesh:
        plugin = build("meshing/subdivide", {"plugin": "template", **options})
        return plugin(surface, candidate.polycube, candidate.rough_map, candidate.blocks)

    assert [len(hexes(size=size).hexes) for size in (10.0, 0.25, 0.125)] == [8, 64, 512]
    assert len(hexes(size=0.25, finer=2.0).hexes) == 512
    assert len(hexes(size=10.0, across_wall=5).hexes) == 8 * 3**3
    assert len(hexes(level=1).hexes) == 64
    regions = [{"box": [0, 0, 0, 1, 1, 1], "size": 0.1}]
    assert "regions has no effect" in " ".join(hexes(regions=regions).warnings)
    with pytest.raises(MeshingError, match=r"more than max_hexes 100; size .* is possible"):
        hexes(size=0.1, max_hexes=100)


def test_blocks_are_ranked_by_their_own_hexes_and_placed_on_the_unit_cube():
    surface = box()
    exact = blocks.candidate(hex_box((2, 2, 2)), surface, "cube", "mine")
    small = blocks.candidate(hex_box((2, 2, 2), (1.0, 1.0, 0.5)), surface, "cube", "other")
    ranked = Registration()(surface, [small, exact])
    assert ranked[0].candidate is exact
    outer = np.unique(ranked[0].hexes.quads)
    off = abs(2 * ranked[0].positions[outer] - 1).max(axis=1)
    assert off == pytest.approx(np.ones(len(outer)))
