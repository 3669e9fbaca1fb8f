"""Hex meshes of polycubes: counts, patches and placement known exactly."""

import numpy as np
import pytest

from polycube.hexmesh import connectivity as hexes
from polycube.hexmesh.generation import template
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.structure import lattice
from polycube.structure.rough_map import affine_map, identity_map
from polycube.types import Polycube
from tests.fixtures.polycubes import bar, cut, ring


def test_numbers_follow_the_lengths_in_the_model():
    stretched = affine_map(bar(), np.diag([5.0, 1.0, 2.0]), np.zeros(3))
    assert [n.tolist() for n in template.counts(bar(), stretched, 0.5)] == [[20], [4], [4]]
    assert [n.tolist() for n in template.counts(bar(), stretched, 0.1)] == [[100], [10], [20]]
    assert [n.tolist() for n in template.counts(ring(), identity_map(ring()), 1.0)] == [
        [2, 2, 2],
        [2, 2, 2],
        [4],
    ]


def test_lengths_follow_the_bend_and_ignore_empty_boxes():
    bent = affine_map(bar(), np.eye(3), np.zeros(3))
    assert template.interval_lengths(bar(), bent, 0) == pytest.approx([2])
    corner = Polycube([[[1], [1]], [[1], [0]]], [0, 1, 2], [0, 1, 3], [0, 1], (2, 3, 1), ("a",) * 6)
    assert template.interval_lengths(corner, identity_map(corner), 1) == pytest.approx([1, 2])


def test_mesh_of_a_ring():
    mesh = cut(ring(), 1 / 6)
    assert len(mesh.hexes) == 8 * 4 * 6
    assert hexes.genus(mesh) == 1
    assert volume(mesh) == pytest.approx(8 / 9)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() == pytest.approx(1)


def test_patches_are_those_of_the_polycube():
    mesh = cut(ring(), 1 / 6)
    faces = lattice.boundary(ring())
    assert set(mesh.patch) == set(faces.patch) == set(range(10))
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    a, b, c, d = np.moveaxis(mesh.vertices[mesh.quads], 1, 0)
    axis = np.cross(c - a, d - b)
    for patch in range(10):
        own = faces.vertices[faces.quads[faces.patch == patch]].reshape(-1, 3)
        low, high = own.min(axis=0) - 1e-9, own.max(axis=0) + 1e-9
        here = middle[mesh.patch == patch]
        assert ((here >= low) & (here <= high)).all()
        label = faces.axis[faces.patch == patch][0]
        assert ((1 - 2 * (label % 2)) * axis[mesh.patch == patch][:, label // 2] > 0).all()


def test_cells_are_numbered_x_slowest():
    mesh = cut(bar(), 0.25)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    assert np.array_equal(mesh.cell, middle[:, 0] > 1)
