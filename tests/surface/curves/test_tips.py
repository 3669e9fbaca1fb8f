"""The tips of cones are points of a part, to which a vertex of a mesh belongs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.fitting.creases.constraints import match
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.turned import revolved

RADIUS, LENGTH, HEIGHT = 3.0, 5.0, 2.0
SHAPES = "plane", "cylinder", "cone"


def pointed(height: float = HEIGHT, shapes: tuple[str, ...] = SHAPES) -> TriMesh:
    """A cylinder with a conical end."""
    profile = (0, 0), (0, RADIUS), (LENGTH, RADIUS), (LENGTH + height, 0)
    return replace(revolved(*profile), region_shapes=shapes)


def lattice(n: int) -> HexMesh:
    """This part, of n x n x 3 hexes with squares as circles; the vertices are on its surface."""
    mesh = hex_box((n, n, 3))
    x, y, z = (2 * mesh.vertices - [1, 1, 0]).T
    most = np.maximum(abs(x), abs(y))
    flat = RADIUS * most / np.maximum(np.hypot(x, y), 1e-9)
    place = np.column_stack([flat * x, flat * y, z / 2 * (LENGTH + HEIGHT * (1 - most))])
    return hex_mesh(place, mesh.hexes, mesh.quads, mesh.patch, mesh.cell)


def test_the_tip_of_a_cone_is_a_corner_without_curves():
    turn = Rotation.random(random_state=2).as_matrix()
    part = pointed()
    part = replace(part, vertices=part.vertices @ turn.T)
    goal = target(part)
    (tip,) = goal.features.tips
    assert goal.features.tips[tip] == 3 and goal.features.is_fixed[tip]
    place = goal.to_model(goal.features.corners[tip])
    assert place == pytest.approx(turn @ [0, 0, LENGTH + HEIGHT])
    assert goal.followed.tips == goal.features.tips


@pytest.mark.parametrize(
    ("height", "shapes"), [(0.1, SHAPES), (HEIGHT, ("plane", "cylinder", "sphere")), (HEIGHT, ())]
)
def test_flat_cones_and_other_faces_have_no_tip(height, shapes):
    assert not target(pointed(height, shapes)).features.tips


@pytest.mark.parametrize("n", [3, 4])
def test_a_mesh_gets_a_vertex_at_the_tip(n):
    mesh, part = lattice(n), pointed()
    goal = target(part)
    problem, x = FitProblem(mesh, goal, 1), goal.to_unit(mesh.vertices)
    matching = match(problem, x)
    on_cone = mesh.vertices[matching.corner, 2] > LENGTH + 1e-9
    assert on_cone.sum() == 1
    assert goal.to_model(matching.corner_goal[on_cone]) == pytest.approx(
        np.array([[0, 0, LENGTH + HEIGHT]])
    )
    fitted = register_mesh(mesh, goal, 12, features=True)
    found = [each for each in inspect(fitted, part).features if each.kind == "point"]
    assert [each.distance < 0.01 for each in found] == [True]
    assert scaled_jacobian(fitted.vertices, fitted.hexes).min() > 0.4


def test_the_distance_of_a_tip_is_that_of_the_closest_vertex():
    part = pointed()
    (found,) = (e for e in inspect(lattice(3), part).features if e.kind == "point")
    away = np.hypot(RADIUS / 3, HEIGHT / 3)
    assert found.distance * target(part).scale == pytest.approx(away)
    assert found.faces == (2, 3) and found.is_lost


def test_a_face_of_one_quad_has_no_vertex_for_the_tip():
    mesh, goal = lattice(1), target(pointed())
    matching = match(FitProblem(mesh, goal, 1), goal.to_unit(mesh.vertices))
    assert len(matching.corner) == 0
