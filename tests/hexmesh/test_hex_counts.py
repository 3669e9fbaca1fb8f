"""Hexes through walls and edges on rims, compared with counts by hand."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.face_groups import facing, measure
from polycube.hexmesh.hex_counts import around, curve_length, edge_length, rims, through
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder, pillowed_cube, rings


def towards(mesh):
    """Number of the axis direction that each boundary quad faces, -x first."""
    return facing(measure(mesh.vertices[mesh.quads]).normal)


def test_through_a_box_there_are_the_hexes_of_each_axis():
    mesh = hex_box((2, 3, 5))
    count, end = through(mesh)
    assert count.tolist() == np.array([2, 2, 3, 3, 5, 5])[towards(mesh)].tolist()
    assert (end[end] == np.arange(len(end))).all()
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    across = np.linalg.norm(middle - middle[end], axis=1)
    assert across == pytest.approx(np.ones(len(end)))  # straight to the other side


def test_a_layer_under_the_boundary_counts_on_both_sides():
    count, _ = through(hex_ball(3))
    assert set(count.tolist()) == {3 + 4}  # a core of 3 and two layers at each end


def test_the_path_follows_a_sheet_around_a_corner():
    """Of a cube of 4 hexes, with a layer round the 2 in the middle of x and y."""
    mesh = pillowed_cube(axes=2)
    count, end = through(mesh)
    sides = towards(mesh)
    assert set(count[sides < 2].tolist()) == {4, 6}
    assert set(count[sides >= 4].tolist()) == {4}
    assert (np.bincount(end) == 1).all()


def test_edges_round_a_ring_and_the_lengths_of_its_rims():
    mesh = rings((1.0, 2.0, 3.0), n=12)
    corners = mesh.vertices[mesh.quads]
    radius = np.linalg.norm(corners[:, :, :2], axis=2)
    inner = np.flatnonzero(radius.max(axis=1) < 1.1)
    assert around(mesh, inner) == 12
    found = rims(mesh.vertices, mesh.quads[inner])
    assert [len(edges) for edges in found] == [12, 12]
    side = 2 * np.sin(np.pi / 12)
    assert [curve_length(mesh.vertices, edges) for edges in found] == pytest.approx([12 * side] * 2)
    assert edge_length(mesh, inner) == pytest.approx((0.2 + side) / 2)


def test_a_small_hole_in_a_wide_face_is_no_rim_of_it():
    mesh = rings((1.0, 2.0, 3.0), n=12)
    top = np.flatnonzero((mesh.vertices[mesh.quads][:, :, 2] > 0.1).all(axis=1))
    assert around(mesh, top) == 12
    assert len(rims(mesh.vertices, mesh.quads[top])) == 1  # radius 3; that of 1 is too short


def test_the_rim_with_the_fewest_edges_counts():
    mesh = hex_cylinder(n=2)
    side = towards(mesh) < 4
    assert around(mesh, np.flatnonzero(side)) == 8
    one = np.flatnonzero(side)[:1]
    assert around(mesh, one) == 4


def test_a_closed_surface_has_no_rim():
    mesh = hex_box((2, 2, 2))
    assert rims(mesh.vertices, mesh.quads) == []
    assert around(mesh, np.arange(len(mesh.quads))) == 0


def test_numbers_do_not_depend_on_the_order_of_the_hexes():
    mesh = hex_box((3, 2, 4))
    order = np.random.default_rng(0).permutation(len(mesh.hexes))
    mixed = replace(mesh, hexes=mesh.hexes[order])
    assert through(mixed)[0].tolist() == through(mesh)[0].tolist()
