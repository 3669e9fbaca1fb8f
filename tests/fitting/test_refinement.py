"""Refined meshes: closer to the surface, valid, within the limit of quality."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from polycube.fitting import refinement
from polycube.fitting.problem import FitProblem
from polycube.hexmesh import connectivity as hexes
from polycube.hexmesh.connectivity import split
from polycube.hexmesh.generation.template import mesh
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import deviation
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.structure.rough_map import affine_map
from polycube.surface.fit_target import target
from polycube.types import HexMesh, Polycube, TriMesh
from tests.fixtures.machined import BLOCK, prism


@pytest.fixture(scope="module")
def sphere() -> TriMesh:
    ball = trimesh.creation.icosphere(subdivisions=4)
    return TriMesh(ball.vertices, ball.faces)


@pytest.fixture(scope="module")
def coarse() -> HexMesh:
    """A ball of 4 x 4 x 4 hexes, the boundary on the unit sphere."""
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    block = mesh(cube, affine_map(cube, 2 * np.eye(3), -np.ones(3)), ([4], [4], [4]))
    x = block.vertices
    a, b, c = np.moveaxis(x**2, 1, 0)
    round_ = x * np.sqrt(
        1
        - np.stack([b + c, c + a, a + b], axis=1) / 2
        + np.stack([b * c, c * a, a * b], axis=1) / 3
    )
    return replace(block, vertices=round_)


@pytest.mark.slow
def test_a_refined_ball_is_closer_to_the_surface(coarse, sphere):
    fine = refinement.refine(coarse, sphere)
    assert len(fine.hexes) == 512
    hexes.check_conforming(fine)
    before, after = deviation(coarse, sphere), deviation(fine, sphere)
    assert after.to_mesh.p99 < before.to_mesh.p99 / 2
    assert after.to_mesh.mean < before.to_mesh.mean / 3
    worst = scaled_jacobian(coarse.vertices, coarse.hexes).min()
    assert inspect(fine, sphere).scaled_jacobian >= 0.9 * worst


def test_a_mesh_that_matches_its_part_is_refined_too():
    """A box of hexes on the same box, whose faces are those of a CAD model."""
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    block = mesh(cube, affine_map(cube, np.eye(3), np.zeros(3)), ([3], [3], [3]))
    solid = prism(BLOCK)
    part = TriMesh(solid.vertices / [4, 3, 2], solid.faces, solid.region)
    fine = refinement.refine(block, part, exact=True)
    assert len(fine.hexes) == 8 * 27
    found = inspect(fine, part)
    assert found.scaled_jacobian == pytest.approx(1, abs=1e-3)
    assert max(feature.distance for feature in found.features) < 1e-3


@pytest.mark.slow
def test_the_mesh_is_unchanged_if_no_finer_mesh_is_good(coarse, sphere, monkeypatch):
    monkeypatch.setattr(refinement, "LEAST", 1.0)
    monkeypatch.setattr(refinement, "RELATIVE_LEAST", np.inf)
    assert refinement.refine(coarse, sphere) is coarse


@pytest.mark.parametrize("seed", range(3))
def test_advance_respects_the_limit_of_every_hex(coarse, sphere, seed):
    fine = split(coarse)
    problem = FitProblem(fine, target(sphere), 10)
    x = target(sphere).to_unit(fine.vertices)
    rng = np.random.default_rng(seed)
    wanted = x + rng.normal(0, 0.01, x.shape) * (rng.random((len(x), 1)) < 0.2)
    least = 0.3
    assert problem.scaled_jacobian(wanted).min() < least
    found = refinement.advance(problem, x, wanted, least)
    allowed = np.minimum(least, problem.scaled_jacobian(x) - 1e-6)
    assert (problem.scaled_jacobian(found) >= allowed).all()
    moved = np.linalg.norm(found - x, axis=1).sum() / np.linalg.norm(wanted - x, axis=1).sum()
    assert 0.2 < moved < 1


def test_advance_reaches_permitted_positions(coarse, sphere):
    problem = FitProblem(coarse, target(sphere), 10)
    x = target(sphere).to_unit(coarse.vertices)
    assert np.array_equal(refinement.advance(problem, x, x + 0.01, 0.2), x + 0.01)
