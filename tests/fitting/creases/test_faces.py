"""CAD faces of the boundary quads, from the paths of the curves."""

import numpy as np
import pytest

from polycube.fitting.creases.constraints import match, on_crease, quad_faces
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import matched_curves, register_mesh
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from polycube.types import HexMesh
from tests.fixtures.polycubes import bar, cut
from tests.fixtures.surfaces import halved_box


@pytest.fixture(scope="module")
def mesh() -> HexMesh:
    """The part itself, in hexes of a quarter."""
    return cut(bar(), 0.25)


def expected(mesh: HexMesh) -> np.ndarray:
    x, y, z = mesh.vertices[mesh.quads].mean(axis=1).T
    sides = [x == 0, x == 2, y == 0, y == 1, z == 0, x < 1]
    return np.select(sides, [1, 2, 3, 4, 5, 6], 7)


def test_cad_face_of_each_quad(mesh):
    goal = target(halved_box())
    problem, x = FitProblem(mesh, goal, 1), goal.to_unit(mesh.vertices)
    matching = match(problem, x)
    assert len(matching.routes) == 15
    assert problem.cad_face.tolist() == expected(mesh).tolist()
    inside = problem.vertex_face > 0
    assert inside.sum() == sum((a - 1) * (b - 1) for a, b in [(4, 4)] * 4 + [(8, 4)] * 3)


def test_a_face_without_a_closed_border_is_unknown(mesh):
    goal = target(halved_box())
    problem, x = FitProblem(mesh, goal, 1), goal.to_unit(mesh.vertices)
    matching = match(problem, x)
    routes = [r for r in matching.routes if r.crease.faces != (6, 7)]
    on = on_crease(problem, matching) & True
    found = quad_faces(problem, x, on, [r.crease for r in routes])
    assert set(found) == {0, 1, 2, 3, 4, 5}
    assert ((found == 0) == np.isin(expected(mesh), [6, 7])).all()


def test_a_curve_within_a_flat_side_gets_its_edges(mesh):
    """The lattice is shifted by 8 % of its length; closest points alone would not correct it."""
    goal = target(halved_box())
    bent = mesh.vertices + np.outer(0.16 * np.sin(np.pi * mesh.vertices[:, 0] / 2), [1, 0, 0])
    start = hex_mesh(bent, mesh.hexes, mesh.quads, mesh.patch, mesh.cell)
    assert matched_curves(start, goal) == 15
    fitted = register_mesh(start, goal, 12, features=True)
    problem = FitProblem(fitted, goal, 1)
    route = next(
        r for r in match(problem, goal.to_unit(fitted.vertices)).routes if r.crease.faces == (6, 7)
    )
    assert np.abs(fitted.vertices[route.vertices, 0] - 1).max() < 0.003
    assert scaled_jacobian(fitted.vertices, fitted.hexes).min() > 0.95
    free = register_mesh(start, goal, 12)
    assert np.abs(free.vertices[route.vertices, 0] - 1).max() > 0.01
