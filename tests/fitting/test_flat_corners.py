"""Flat corners of boundary quads, and sheets that cure them."""

import numpy as np
import pytest

from polycube.errors import BadOption
from polycube.fitting.creases.constraints import match, on_goals
from polycube.fitting.flat_corners import corners, without_flat_corners
from polycube.fitting.polish import polish
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh
from polycube.hexmesh import connectivity as hexes
from polycube.hexmesh.generation import template
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.registry import build
from polycube.surface.fit_target import Target, target
from polycube.types import HexMesh, TriMesh
from tests.fixtures.machined import BLOCK, pocketed, prism
from tests.fixtures.polycubes import PRIMITIVES


def fitted(surface: TriMesh, size: float = 0.5) -> HexMesh:
    """Hexes of a polycube from labels, registered with their vertices on the curves."""
    propose = build("structure", {"plugin": "labels"}, grid=(2, 1, 1), primitives=PRIMITIVES)
    best = propose(surface, ())[0]
    counts = template.counts(best.polycube, best.rough_map, size)
    start = template.mesh(best.polycube, best.rough_map, counts)
    return register_mesh(start, target(surface), features=True)


def flat_quads(mesh: HexMesh, goal: Target) -> np.ndarray:
    """Centres (N, 3) of the quads with a flat corner."""
    problem, x = FitProblem(mesh, goal, 1), goal.to_unit(mesh.vertices)
    matching = match(problem, x)
    flat, _ = corners(problem, on_goals(problem, x, matching), matching)
    return mesh.vertices[mesh.quads[flat.any(axis=1)]].mean(axis=1)


def floor_of(surface: TriMesh) -> int:
    """Number of the CAD face that is the floor of the pocket, at z = 1."""
    level = surface.vertices[surface.faces][..., 2]
    return int(np.unique(surface.region[(level == 1).all(axis=1)])[0])


@pytest.fixture(scope="module")
def pocket() -> tuple[TriMesh, HexMesh]:
    surface = pocketed()
    return surface, fitted(surface)


def test_the_floor_of_a_triangular_pocket_has_one_flat_corner(pocket):
    surface, mesh = pocket
    found = flat_quads(mesh, target(surface))
    assert len(found) == 1
    assert found[0, 2] == pytest.approx(1, abs=0.05)


def test_a_sheet_removes_the_flat_corner_without_loss_of_features(pocket):
    surface, mesh = pocket
    goal = target(surface)
    cured = without_flat_corners(mesh, goal)
    hexes.check_conforming(cured)
    assert len(flat_quads(cured, goal)) == 0
    poor, good = (polish(each, goal, exact=True) for each in (mesh, cured))
    assert scaled_jacobian(poor.vertices, poor.hexes).min() < 0.35
    assert scaled_jacobian(good.vertices, good.hexes).min() > 0.6
    assert max(feature.distance for feature in inspect(good, surface).features) < 0.003


def test_the_other_corners_of_the_floor_have_one_quad_each(pocket):
    surface, mesh = pocket
    goal = target(surface)
    cured = without_flat_corners(mesh, goal)
    problem, x = FitProblem(cured, goal, 1), goal.to_unit(cured.vertices)
    matching = match(problem, x)
    floor = problem.quads[problem.cad_face == floor_of(surface)]
    assert len(floor) > 0
    at_corners = np.isin(floor, matching.corner)
    assert at_corners.sum() == 3


def test_a_block_without_flat_corners_is_unchanged():
    block = prism(BLOCK)
    mesh = fitted(block)
    assert without_flat_corners(mesh, target(block)) is mesh


def test_sheets_are_an_option_of_the_pillow(pocket):
    surface, mesh = pocket
    made = {
        name: build("meshing/pillow", {"plugin": "selective", "sheets": name})(surface, mesh)
        for name in ("polycube", "none")
    }
    assert len(made["polycube"].hexes) > len(made["none"].hexes)
    soft = build("meshing/pillow", {"plugin": "selective", "features": "soft", "patches": "none"})
    assert soft(surface, mesh) is mesh
    with pytest.raises(BadOption, match="sheets must be one of polycube, all, none"):
        build("meshing/pillow", {"plugin": "selective", "sheets": "some"})


def test_sheets_and_registration_preserve_paths(pocket):
    surface, mesh = pocket
    goal = target(surface)
    assert not without_flat_corners(mesh, goal).paths
    cured = without_flat_corners(mesh, goal, keep_paths=True)
    assert cured.paths
    settled = register_mesh(cured, goal, features=True)
    problem = FitProblem(settled, goal, 1)
    routes = match(problem, goal.to_unit(settled.vertices)).routes
    number = {id(crease): str(k) for k, crease in enumerate(goal.features.creases)}
    found = {number[id(route.crease)]: route.vertices.tolist() for route in routes}
    assert found.items() >= {k: path.tolist() for k, path in cured.paths.items()}.items()
    edges = {tuple(edge) for edge in np.sort(problem.sides, axis=1).tolist()}
    assert {tuple(sorted(e)) for route in routes for e in route.sides.tolist()} <= edges
