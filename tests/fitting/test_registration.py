"""Registration of a box on surfaces with known answers."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh, short_quality
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.quality import deviation
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from polycube.types import TriMesh
from tests.fixtures.fitting import cube, sphere
from tests.fixtures.hexmeshes import unit_cubes


def test_a_cube_becomes_a_ball():
    ball = sphere()
    mesh = register_mesh(cube(), target(ball))
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.2
    assert deviation(mesh, ball).vertices < 0.006
    assert deviation(mesh, ball).to_mesh.largest < 0.02


def test_units_and_placement_do_not_matter():
    """A power of two scales exactly."""
    plain = register_mesh(cube(), target(sphere()), rounds=5)
    large = register_mesh(cube(scale=1.2 * 1024), target(sphere(1024)), rounds=5)
    assert np.array_equal(large.vertices, 1024 * plain.vertices)
    turn = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()  # no two feet equally suitable
    start = hex_mesh(cube().vertices @ turn, cube().hexes)
    moved = hex_mesh(start.vertices + 10, start.hexes)
    plain = register_mesh(start, target(sphere()), rounds=1, iterations=3)
    moved = register_mesh(moved, target(sphere(shift=10.0)), rounds=1, iterations=3)
    assert moved.vertices - 10 == pytest.approx(plain.vertices, abs=1e-9)


def test_registration_is_reproducible():
    a, b = (register_mesh(cube(), target(sphere()), rounds=3).vertices for _ in range(2))
    assert np.array_equal(a, b)


def test_registration_untangles_hexes():
    start = cube()
    rng = np.random.default_rng(0)
    tangled = hex_mesh(start.vertices + 0.2 * rng.normal(size=start.vertices.shape), start.hexes)
    assert scaled_jacobian(tangled.vertices, tangled.hexes).min() < -0.5
    mesh = register_mesh(tangled, target(sphere()))
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.2


def test_a_valid_mesh_stays_valid_on_a_surface_it_cannot_fit():
    """A cube on an inside-out surface: all springs act to invert the hexes."""
    ball = sphere()
    inside_out = TriMesh(ball.vertices, ball.faces[:, ::-1])
    mesh = register_mesh(cube(), target(inside_out), rounds=6)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0


def test_short_quality_of_an_exact_mesh():
    surface = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
    vertices, cubes = unit_cubes(2, 2, 2)
    goal = target(TriMesh(surface.vertices, surface.faces))
    found = short_quality(hex_mesh(vertices / 2, cubes), goal)
    assert (found.to_surface, found.to_mesh, found.bad) == pytest.approx((0, 0, 0), abs=1e-9)
    assert (found.mean_jacobian, found.min_jacobian) == pytest.approx((1, 1))
    assert found.volume_ratio == pytest.approx(1)
    moved = short_quality(hex_mesh(vertices / 2 + np.array([0.1, 0, 0]), cubes), goal)
    assert moved.to_surface == pytest.approx(100 * 0.1 / np.sqrt(3))


def test_size_and_wanted_lengths_of_a_stretched_box():
    surface = target(sphere())
    vertices, cubes = unit_cubes(3, 3, 3)
    problem = FitProblem(hex_mesh(vertices * [1, 2, 3], cubes), surface, 100)
    x = vertices * np.array([1.0, 2, 3])
    wanted = problem.lengths(x, smooth=3, isotropy=0.0)
    assert wanted == pytest.approx(np.tile([1, 2, 3], (27, 1)))
    assert problem.lengths(x, smooth=0, isotropy=1.0) == pytest.approx(
        np.full((27, 3), 6 ** (1 / 3))
    )
    corner = np.flatnonzero((vertices == 0).all(axis=1))
    assert problem.size(x)[corner] == pytest.approx(2)
    normals, _ = problem.normals(x)
    assert normals[corner[0]] == pytest.approx(-np.array([6, 3, 2]) / 7)


def test_lengths_are_smoothed_along_their_own_direction():
    """One thick layer: its thickness spreads to the neighbours, the other lengths do not."""
    vertices, cubes = unit_cubes(3, 1, 1)
    vertices[:, 0] = np.array([0.0, 1, 5, 6])[vertices[:, 0].astype(int)]
    problem = FitProblem(hex_mesh(vertices, cubes), target(sphere()), 100)
    wanted = problem.lengths(vertices, smooth=1, isotropy=0.0)
    assert wanted[:, 1:] == pytest.approx(1)
    assert wanted[:, 0] == pytest.approx([2, 2, 2])
