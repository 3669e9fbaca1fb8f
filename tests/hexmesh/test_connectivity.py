"""Connectivity of hex meshes compared with counts by hand."""

import numpy as np
import pytest

from polycube.hexmesh import connectivity as hexes
from tests.fixtures.hexmeshes import unit_cubes


def ring() -> hexes.HexMesh:
    return hexes.hex_mesh(*unit_cubes(3, 3, 1, missing=((1, 1, 0),)))


def test_numbering_is_that_of_a_right_handed_cube():
    vertices, cube = unit_cubes(1, 1, 1)
    for corner, *ends in hexes.CORNERS:
        a, b, c = vertices[cube[0, ends]] - vertices[cube[0, corner]]
        assert a @ np.cross(b, c) == 1
    for face in hexes.FACES:
        a, b, c, d = vertices[cube[0, face]]
        assert np.cross(b - a, d - a) @ (a - 0.5) > 0
    for k, (a, b) in enumerate(vertices[cube[0, hexes.EDGES]]):
        assert np.array_equal(b - a, np.eye(3)[k // 4])


def test_hex_mesh_has_default_quads_patches_and_cells():
    mesh = hexes.hex_mesh(*unit_cubes(2, 2, 2))
    assert mesh.quads.shape == (24, 4)
    assert not mesh.patch.any() and not mesh.cell.any()
    centre = mesh.vertices[mesh.quads].mean(axis=1) - 1
    a, b, c, d = np.moveaxis(mesh.vertices[mesh.quads], 1, 0)
    assert (np.einsum("qd,qd->q", np.cross(c - a, d - b), centre) > 0).all()


def test_edges_and_valences_of_a_box():
    found, count = hexes.edge_valence(unit_cubes(2, 2, 2)[1])
    assert len(found) == len(hexes.edges(unit_cubes(2, 2, 2)[1])) == 54
    assert np.bincount(count).tolist() == [0, 24, 24, 0, 6]


def test_a_box_has_no_extraordinary_inner_edge_but_its_own_edges():
    inner, outer = hexes.extraordinary_edges(hexes.hex_mesh(*unit_cubes(2, 3, 4)))
    assert len(inner) == 0
    assert len(outer) == 4 * (2 + 3 + 4)


def test_extraordinary_edge_of_three_hexes_round_a_line():
    angle = np.arange(6) * np.pi / 3
    flat = np.vstack([[0, 0], np.stack([np.cos(angle), np.sin(angle)], 1)])
    vertices = np.concatenate([np.column_stack([flat, np.full(7, z)]) for z in (0.0, 1.0)])
    base = np.array([[0, 1, 2, 3], [0, 3, 4, 5], [0, 5, 6, 1]])
    mesh = hexes.hex_mesh(vertices, np.hstack([base, base + 7]))
    inner, _ = hexes.extraordinary_edges(mesh)
    assert inner.tolist() == [[0, 7]]


def test_exposed_returns_the_hex_of_each_quad():
    _, cubes = unit_cubes(3, 1, 1)
    quads, owner = hexes.exposed(cubes)
    assert np.bincount(owner).tolist() == [5, 4, 5]
    assert all(np.isin(quad, cubes[hex]).all() for quad, hex in zip(quads, owner, strict=True))


def test_neighbours_pairs_the_common_faces():
    _, cubes = unit_cubes(3, 1, 1)
    first, second = hexes.neighbours(cubes)
    assert sorted(zip(first // 6, second // 6, strict=True)) == [(0, 1), (1, 2)]
    assert sorted(first % 6) == [1, 1] and sorted(second % 6) == [0, 0]


@pytest.mark.parametrize(
    ("mesh", "handles"), [(hexes.hex_mesh(*unit_cubes(3, 2, 1)), 0), (ring(), 1)]
)
def test_genus(mesh, handles):
    assert hexes.genus(mesh) == handles


def test_genus_needs_one_component():
    a, b = unit_cubes(1, 1, 1)
    mesh = hexes.hex_mesh(np.vstack([a, a + 5]), np.vstack([b, b + 8]))
    with pytest.raises(ValueError, match="2 components"):
        hexes.genus(mesh)


def test_check_finds_an_edge_with_four_quads():
    mesh = hexes.hex_mesh(*unit_cubes(2, 2, 1, missing=((0, 0, 0), (1, 1, 0))))
    with pytest.raises(ValueError, match="edges without exactly two quads, first at vertices"):
        hexes.check_conforming(mesh)


def test_check_finds_two_fans_at_a_vertex():
    gone = tuple(i for i in np.ndindex(2, 2, 2) if i not in ((0, 0, 0), (1, 1, 1)))
    with pytest.raises(ValueError, match="2 fans"):
        hexes.check_conforming(hexes.hex_mesh(*unit_cubes(2, 2, 2, missing=gone)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h[:0], "no hexes"),
        (lambda h: h + 1, "must refer to vertices 0 to"),
        (lambda h: np.where(h == h[0, 1], h[0, 0], h), "same vertex twice"),
        (lambda h: np.vstack([h, h[:1]]), "has 3 hexes"),
    ],
)
def test_check_describes_the_defect(change, message):
    vertices, cubes = unit_cubes(2, 1, 1)
    mesh = hexes.HexMesh(
        vertices,
        change(cubes),
        hexes.boundary_quads(cubes),
        np.zeros(10),
        np.zeros(len(change(cubes))),
    )
    with pytest.raises(ValueError, match=message):
        hexes.check_conforming(mesh)


def test_check_requires_the_boundary_as_quads():
    vertices, cubes = unit_cubes(2, 1, 1)
    mesh = hexes.hex_mesh(vertices, cubes, hexes.boundary_quads(cubes)[:-1])
    with pytest.raises(ValueError, match="quads are not the boundary"):
        hexes.check_conforming(mesh)
