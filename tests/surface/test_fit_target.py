"""Targets of a cube: feet, samples, sharp edges, placement."""

import numpy as np
import pytest
import trimesh

from polycube.surface.fit_target import target
from polycube.types import TriMesh
from tests.fixtures.surfaces import halved_box


@pytest.fixture
def cube() -> TriMesh:
    """Edge 2, far from the origin."""
    mesh = trimesh.creation.box((2, 2, 2))
    return TriMesh(mesh.vertices + np.array([100, 0, 0]), mesh.faces)


def test_unit_scale_and_back(cube):
    goal = target(cube)
    assert goal.scale == pytest.approx(np.sqrt(12))
    assert np.linalg.norm(np.ptp(goal.surface.vertices, axis=0)) == pytest.approx(1)
    assert goal.to_model(goal.to_unit(cube.vertices)) == pytest.approx(cube.vertices)
    assert goal.to_model(goal.surface.vertices) == pytest.approx(cube.vertices)


def test_the_same_surface_is_prepared_once(cube):
    assert target(cube) is target(cube)


def test_feet(cube):
    goal = target(cube)
    foot, face = goal.closest(goal.to_unit(np.array([[100.2, 0.1, 5], [100, 0, 0.9]])))
    assert goal.to_model(foot) == pytest.approx(np.array([[100.2, 0.1, 1], [100, 0, 1]]))
    assert goal.normals[face] == pytest.approx(np.array([[0, 0, 1], [0, 0, 1]]))
    sideways = goal.closest(foot[:1], np.eye(3)[:1], alpha=2.0)[1]
    assert goal.normals[sideways[0]] == pytest.approx([1, 0, 0])


def test_feet_on_one_cad_face():
    """From a point above the top: on the face that is requested for, however far it is."""
    goal = target(halved_box())
    points = goal.to_unit(np.array([[0.3, 0.5, 1.1]] * 4))
    foot, triangle = goal.closest(points, cad_face=np.array([0, 6, 7, 2]))
    expected = np.array([[0.3, 0.5, 1], [0.3, 0.5, 1], [1, 0.5, 1], [2, 0.5, 1]])
    assert goal.to_model(foot) == pytest.approx(expected)
    assert goal.surface.region[triangle].tolist() == [6, 6, 7, 2]


def test_samples_are_even_and_on_the_surface(cube):
    goal = target(cube)
    points, normals, _ = goal.samples(600)
    side = np.abs(points).max(axis=1)
    assert side == pytest.approx(1 / np.sqrt(12))
    assert np.einsum("nd,nd->n", points, normals) == pytest.approx(side)
    counts = np.unique(normals.round(9), axis=0, return_counts=True)[1]
    assert counts.tolist() == [100] * 6
    assert goal.samples(600)[0] is points


def test_creases_are_at_unit_scale(cube):
    features = target(cube).features
    assert [c.length for c in features.creases] == pytest.approx([1 / np.sqrt(3)] * 12)
    assert np.abs(features.corners) == pytest.approx(1 / np.sqrt(12))
