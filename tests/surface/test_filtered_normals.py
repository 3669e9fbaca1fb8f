"""Edges and faces seen from a distance: exact on a cube, fine teeth and folded slivers."""

import numpy as np
import pytest

from polycube.surface.curves.creases import features
from polycube.surface.filtered_normals import ROWS, broad_turns, steady_normals
from polycube.surface.fit_target import target
from polycube.surface.measures import face_normals
from polycube.types import TriMesh
from tests.fixtures.surfaces import box


def toothed(teeth: int, depth: float) -> TriMesh:
    """The unit cube with sharp ridges on top, along y."""
    x = np.linspace(0, 1, 2 * teeth + 1)
    high = 1 - depth * (np.arange(len(x)) % 2)
    ring = [(x, y, z) for y in (0, 1) for z in (0, high)]  # front below, above, back below, above
    vertices = np.concatenate([np.stack(np.broadcast_arrays(*line), 1) for line in ring])
    low0, high0, low1, high1 = np.arange(4 * len(x)).reshape(4, -1)

    def strip(a, b):
        return np.stack([a[:-1], a[1:], b[1:], b[:-1]], 1)

    quads = [strip(low0, high0), strip(high1, low1), strip(high0, high1), strip(low1, low0)]
    quads += [np.array([[low0[0], high0[0], high1[0], low1[0]]])]
    quads += [np.array([[low0[-1], low1[-1], high1[-1], high0[-1]]])]
    return TriMesh(vertices, np.concatenate(quads)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))


def fine_box(parts: int) -> TriMesh:
    """The unit cube with so many parts along each edge."""
    surface = box()
    while len(surface.faces) < 12 * parts**2:
        corners = surface.vertices[surface.faces]  # (F, 3, 3)
        a, b, c = np.moveaxis(corners, 1, 0)
        d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
        points = np.concatenate(
            [np.stack(t, 1) for t in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
        ).reshape(-1, 3)
        vertices, index = np.unique(points, axis=0, return_inverse=True)
        surface = TriMesh(vertices, index.reshape(-1, 3))
    return surface


def test_edges_of_a_cube_turn_by_a_right_angle():
    surface = box()
    pairs = np.array([[i, j] for i in range(8) for j in range(i)])
    apart = np.abs(surface.vertices[pairs[:, 0]] - surface.vertices[pairs[:, 1]]) > 0.5
    sides = pairs[apart.sum(axis=1) == 1]
    assert len(sides) == 12
    turns = broad_turns(surface, face_normals(surface), sides, 0.1)
    assert turns == pytest.approx(np.full(12, np.pi / 2), abs=1e-6)


def test_ridges_of_fine_teeth_turn_little():
    surface = toothed(60, 1 / 120)
    ridge = np.array([[121 + i, 3 * 121 + i] for i in range(20, 100)])
    assert np.ptp(surface.vertices[ridge], axis=1)[:, 1] == pytest.approx(1)
    assert broad_turns(surface, face_normals(surface), ridge, 0.1).max() < np.deg2rad(40)


def test_short_creases_of_a_rough_cube_are_noise_and_its_edges_are_not():
    smooth = fine_box(32)
    noise = np.random.default_rng(0).normal(0, 0.004, smooth.vertices.shape)
    found = target(TriMesh(smooth.vertices + noise, smooth.faces)).features
    assert len(found.noise) > 100
    points = np.concatenate([crease.points for crease in found.creases])
    to_edge = np.sort(np.abs(np.abs(points) - 0.5 / np.sqrt(3)), axis=1)[:, 1]
    assert to_edge.max() < 0.03
    assert sum(crease.length for crease in found.creases) > 11 / np.sqrt(3)


def test_many_edges_are_taken_in_turn():
    surface = toothed(20, 0.02)
    sides = np.unique(np.sort(surface.faces[:, :2], axis=1), axis=0)
    in_one_batch = broad_turns(surface, face_normals(surface), sides, 0.1)
    times = 1 + ROWS // len(sides)
    found = broad_turns(surface, face_normals(surface), np.tile(sides, (times, 1)), 0.1)
    assert np.array_equal(found, np.tile(in_one_batch, times))


def test_coarse_teeth_are_meant():
    surface = toothed(10, 0.1)
    found = features(surface, face_normals(surface))
    inner = [
        crease
        for crease in found.creases
        if np.ptp(crease.points[:, 1]) > 0.9 and 0.01 < crease.points[:, 0].mean() < 0.99
    ]
    assert len(inner) == 2 * 10 - 1
    assert len(found.noise) == 0


def test_a_surface_without_noise_keeps_its_normals():
    goal = target(fine_box(8))
    assert len(goal.features.noise) == 0
    assert np.array_equal(goal.normals, face_normals(goal.surface))


def test_a_folded_face_looks_where_its_neighbours_do():
    surface = fine_box(32)
    normals = face_normals(surface)
    middle = surface.vertices[surface.faces].mean(axis=1)
    folded = np.argmin(np.linalg.norm(middle - [0.4, 0.4, 1], axis=1))
    wrong = normals.copy()
    wrong[folded] *= -1
    top = np.flatnonzero(
        (surface.vertices[:, 2] == 1) & (surface.vertices[:, :2] > 0.1).all(axis=1)
    )
    steady = steady_normals(surface, wrong, np.stack([top, top], axis=1), 0.1)
    assert steady[folded] @ [0, 0, 1] > 0.99
    low = middle[:, 2] < 0.9
    assert np.array_equal(steady[low], wrong[low])
    few = steady_normals(surface, wrong, surface.faces[folded][None, :2], 0.1)
    assert np.array_equal(few, wrong)


@pytest.mark.slow
def test_normals_of_a_rough_cube_are_steadier():
    smooth = fine_box(32)
    noise = np.random.default_rng(0).normal(0, 0.01, smooth.vertices.shape)
    goal = target(TriMesh(smooth.vertices + noise, smooth.faces))
    inner = np.abs(smooth.vertices[smooth.faces].mean(axis=1) - 0.5)
    inner = np.sort(inner, axis=1)[:, 1] < 0.4  # away from the edges
    true = face_normals(smooth)[inner]
    raw, steady = face_normals(goal.surface)[inner], goal.normals[inner]
    turned = [np.arccos(np.clip(np.einsum("nd,nd->n", n, true), -1, 1)) for n in (raw, steady)]
    assert turned[1].mean() < 0.5 * turned[0].mean()
