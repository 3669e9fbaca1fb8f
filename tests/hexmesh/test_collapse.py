"""Columns of hexes along convex edges are collapsed, so that two hexes meet there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycube.hexmesh.connectivity import check_conforming, edge_valence, genus, hex_mesh
from polycube.hexmesh.quality import volume
from polycube.plugins.structure.background.moved_back import collapsed
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import hex_box


def along(mesh: HexMesh, *low: bool) -> np.ndarray:
    """(E, 2) edges along z where x and y are smallest, or along y where x and z are."""
    x, n = mesh.vertices, int(mesh.vertices.max())
    axis = 2 if len(low) < 2 or low[1] else 1
    at = np.flatnonzero((x[:, [k for k in range(3) if k != axis]] == 0).all(axis=1))
    at = at[np.argsort(x[at, axis])]
    assert len(at) == n + 1
    return np.stack([at[:-1], at[1:]], axis=1)


@given(st.integers(2, 5))
def test_a_column_along_an_edge_of_a_box_is_collapsed(n):
    mesh = hex_box((n, n, n), (n, n, n))
    free = np.zeros(len(mesh.vertices), bool)
    ends = along(mesh)
    found = collapsed(mesh, ends, free)
    check_conforming(found)
    assert len(found.hexes) == n**3 - n and genus(found) == 0
    assert len(found.vertices) == (n + 1) ** 3 - 2 * (n + 1)  # two are one, and the edge is gone
    assert volume(found) == pytest.approx(n**3)
    on_edge = np.flatnonzero((found.vertices[:, :2] == 0).all(axis=1))
    assert len(on_edge) == n + 1  # the places of the edge
    edges, valence = edge_valence(found.hexes)
    assert (valence[np.isin(edges, on_edge).all(axis=1)] == 2).all()


def test_lines_beside_fixed_vertices_or_with_a_common_hex_are_left():
    mesh = hex_box((3, 3, 3), (3, 3, 3))
    ends = along(mesh)
    fixed = np.zeros(len(mesh.vertices), bool)
    fixed[(mesh.vertices == [1, 0, 2]).all(axis=1)] = True
    assert len(collapsed(mesh, ends, fixed).hexes) == 27
    crossing = np.concatenate([ends, along(mesh, True, False)])
    assert len(collapsed(mesh, crossing, np.zeros_like(fixed)).hexes) == 27
    inner = np.flatnonzero((mesh.vertices[:, :2] == 1).all(axis=1))[:2]
    assert len(collapsed(mesh, inner[None], np.zeros_like(fixed)).hexes) == 27


def test_one_line_is_left_and_another_one_collapsed():
    mesh = hex_box((4, 4, 4), (4, 4, 4))
    x = mesh.vertices
    at = np.flatnonzero((x[:, :2] == 4).all(axis=1))
    other = np.stack([at[:-1], at[1:]], axis=1)
    fixed = (x == [1, 0, 2]).all(axis=1)
    found = collapsed(mesh, np.concatenate([along(mesh), other]), fixed)
    check_conforming(found)
    assert len(found.hexes) == 64 - 4


def test_a_line_that_ends_inside_the_mesh_is_left():
    """A post of 2 x 2 below a slab of 3 x 3."""
    box = hex_box((3, 3, 3), (3, 3, 3))
    x, y, z = box.vertices[box.hexes].mean(axis=1).T
    mesh = hex_mesh(box.vertices - [1, 1, 0], box.hexes[(z > 2) | ((x > 1) & (y > 1))])
    at = np.flatnonzero((mesh.vertices[:, :2] == 0).all(axis=1))
    at = at[np.argsort(mesh.vertices[at, 2])][:3]
    ends = np.stack([at[:-1], at[1:]], axis=1)
    assert len(collapsed(mesh, ends, np.zeros(len(mesh.vertices), bool)).hexes) == 9 + 8
