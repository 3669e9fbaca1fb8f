import numpy as np
import pytest

from polycube.analysis.boundary_sets import faces_of, trace
from polycube.analysis.constraints import Support, constrain, free_rigid_motions
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import hex_ball, hex_cylinder
from tests.fixtures.splines import box, cube, spline_of, unclamped

SPACES = {
    "h2s": lambda: cube(3, "h2s"),
    "optimal": lambda: cube(2),
    "c0": lambda: cube(2, "c0"),
    "unclamped": lambda: unclamped(3),
    "cylinder": lambda: spline_of(hex_cylinder(2, 2, 2), "h2s"),
}


@pytest.mark.parametrize("space", first_quick(2, SPACES))
def test_free_fields_vanish_on_constrained_faces_with_the_fewest_constraints(space):
    spline = SPACES[space]()
    faces = faces_of(spline, "z_min")
    constraints = constrain(spline, [Support("z_min", faces, (0,))], 1)
    here = trace(spline, faces)
    assert abs(here.shape @ constraints.basis).max() < 1e-9
    rank = np.linalg.matrix_rank(here.shape.toarray(), tol=1e-9)
    assert constraints.basis.shape == (len(spline.control), len(spline.control) - rank)
    assert np.linalg.matrix_rank(constraints.basis.toarray()) == constraints.basis.shape[1]


@pytest.mark.parametrize("space", first_quick(2, SPACES))
def test_values_in_the_space_are_prescribed_exactly(space):
    spline = SPACES[space]()
    faces = np.arange(len(spline.sides))
    slopes = np.array([[1.0, -2.0], [3.0, 0.5], [0.0, 7.0]])
    constraints = constrain(spline, [Support("all", faces, (0, 2), lambda x: x @ slopes)], 3)
    here = trace(spline, faces)
    found = here.shape @ constraints.offset.reshape(-1, 3)
    assert found[:, [0, 2]] == pytest.approx(here.points @ slopes, abs=1e-8)
    assert not constraints.offset.reshape(-1, 3)[:, 1].any()
    rng = np.random.default_rng(0)
    moved = (constraints.basis @ rng.normal(size=constraints.basis.shape[1])).reshape(-1, 3)
    assert abs(here.shape @ moved[:, [0, 2]]).max() < 1e-8
    assert abs(here.shape @ moved[:, 1]).max() > 0.1


@pytest.mark.slow
def test_inner_functions_vanish_on_the_boundary():
    mesh = hex_ball(2)
    spline = spline_of(mesh, "h2s")  # a function for each vertex
    constraints = constrain(spline, [Support("all", np.arange(len(spline.sides)), (0,))], 1)
    assert np.array_equal(np.sort(constraints.bound[0].pivots), np.unique(mesh.quads))


@pytest.mark.parametrize(
    ("components", "free"),
    first_quick(
        2,
        [
            ({}, 6),
            ({"z_min": "xyz"}, 0),
            ({"z_min": "z"}, 3),
            ({"z_min": "xy"}, 3),  # turning about an axis in the plane moves it out of itself
            ({"z_min": "z", "x_min": "x"}, 1),
            ({"z_min": "z", "x_min": "x", "y_min": "y"}, 0),
            ({"z_min": "x", "z_max": "x"}, 3),
        ],
    ),
)
def test_number_of_free_rigid_motions(components, free):
    spline = box((2, 1, 1), (3.0, 1.0, 2.0), "h2s")
    supports = [
        Support(place, faces_of(spline, place), tuple("xyz".index(axis) for axis in axes))
        for place, axes in components.items()
    ]
    assert free_rigid_motions(spline, constrain(spline, supports, 3)) == free


def test_the_last_support_of_a_face_has_precedence():
    spline = cube(2)
    every = np.arange(len(spline.sides))
    top = faces_of(spline, "z_max")
    supports = [Support("all", every, (0,), 1.0), Support("all but the bottom", every, (0,), 3.0)]
    constraints = constrain(spline, supports, 1)
    assert trace(spline, top).shape @ constraints.offset == pytest.approx(
        np.full(100, 3.0), abs=1e-12
    )


def test_resultants_of_a_known_traction():
    """Traction on two faces with a common edge: exact sum; the parts differ by the jump there."""
    spline = unclamped(3)
    ends = {"x_min": 2.0, "y_max": -5.0}
    faces = {name: faces_of(spline, name) for name in ends}
    constraints = constrain(spline, [Support(name, faces[name], (0,)) for name in ends], 1)
    residual = sum(
        trace(spline, faces[name]).moments(np.full(9 * 25, value)) for name, value in ends.items()
    )
    each = np.array([[2.0], [-5.0]])
    assert constraints.reactions(residual).sum() == pytest.approx(-3.0, abs=1e-8)
    assert constraints.reactions(residual) == pytest.approx(each, abs=0.3)
