"""Self-intersections of the boundary: counted by hand, and by a linear program per pair."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from polycube.hexmesh.connectivity import check_conforming, hex_mesh
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import CORNERS, hex_box, hex_cylinder, unit_cubes

# corners of the faces S1 to S6 of Abaqus' manual, from 0
ABAQUS = np.array(
    [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
)


def block(low, high) -> HexMesh:
    """One hex."""
    return hex_mesh(low + CORNERS * np.subtract(high, low), np.arange(8)[None])


def both(first: HexMesh, second: HexMesh) -> HexMesh:
    """Two meshes as one."""
    return hex_mesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.hexes, second.hexes + len(first.vertices)]),
    )


@pytest.mark.parametrize("mesh", [hex_box(), hex_box((5, 4, 3), (9, 1, 0.01)), hex_cylinder()])
def test_valid_meshes_have_no_crossings_in_any_orientation(mesh):
    for seed in range(4):
        turn = Rotation.random(random_state=seed).as_matrix()
        turned = hex_mesh(mesh.vertices @ turn.T, mesh.hexes)
        assert crossings(turned).shape == (0, 2)


def test_a_bar_through_a_block_crosses_top_and_bottom_with_each_of_its_sides():
    mesh = both(block((0, 0, 0), (4, 4, 4)), block((1, 1.5, -1), (2, 2.5, 5)))
    upright = np.ptp(mesh.vertices[mesh.quads][:, :, 2], axis=1) > 0
    ends, sides = np.flatnonzero(~upright[:6]), 6 + np.flatnonzero(upright[6:])
    expected = [[end, side] for end in ends for side in sides]
    assert crossings(mesh).tolist() == expected and len(expected) == 8


@pytest.mark.parametrize(("gap", "meet"), [(0.1, False), (0.0, True), (-0.1, True)])
def test_blocks_with_coplanar_tops_cross_from_contact_on(gap, meet):
    first = block((0, 0, 0), (1, 1, 1))
    second = block((1 + gap, 0.25, 0.5), (2, 0.75, 1))
    found = crossings(both(first, second))
    assert (len(found) > 0) == meet
    assert (found[:, 0] < 6).all() and (found[:, 1] >= 6).all()


@pytest.mark.parametrize(("shear", "cross"), [(0.4, False), (0.5, True), (0.8, True)])
def test_legs_bent_into_each_other(shear, cross):
    """All hexes are sheared cubes: only the crossings show that the legs overlap."""
    vertices, hexes = unit_cubes(3, 1, 3, missing=((1, 0, 1), (1, 0, 2)))
    left = vertices[:, 0] <= 1
    vertices[left, 0] += shear * np.maximum(vertices[left, 2] - 1, 0)
    mesh = hex_mesh(vertices, hexes)
    check_conforming(mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.7
    found = crossings(mesh)
    assert (len(found) > 0) == cross
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    assert (middle[found][:, :, 2] >= 2).all()  # at the ends of the legs only


def test_a_fold_of_neighbours_beyond_their_common_edge():
    """A corner of the top pulled down through the bottom crosses it, one above it does not."""
    mesh = hex_box((3, 3, 1))
    corner = (mesh.vertices == [0, 0, 1]).all(axis=1)
    for height, cross in ((0.2, False), (-0.2, True)):
        moved = mesh.vertices + corner[:, None] * [0.5, 0.5, height - 1]
        assert (len(crossings(hex_mesh(moved, mesh.hexes))) > 0) == cross


@pytest.mark.parametrize("face", range(6))
def test_quads_are_split_from_the_first_corner_of_abaqus_faces(face):
    """A small block on the ridge of a saddle meets it; halfway to the valley it does not."""
    first, _, third, _ = ABAQUS[face]
    vertices = CORNERS.astype(float)
    middle = vertices[ABAQUS[face]].mean(axis=0)
    outwards = middle - 0.5
    vertices[[first, third]] += 0.4 * outwards  # the ridge; the other diagonal is the valley
    saddle = hex_mesh(vertices, np.arange(8)[None])
    for height, meets in ((0.4, True), (0.2, False)):
        centre = middle + height * outwards
        assert (len(crossings(both(saddle, block(centre - 0.01, centre + 0.01)))) > 0) == meets


def meet(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two triangles have a common point: weights of their corners by a linear program."""
    equal = np.vstack([np.hstack([first.T, -second.T]), [1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1]])
    return linprog(np.zeros(6), A_eq=equal, b_eq=[0, 0, 0, 1, 1]).status == 0


def every_pair(mesh: HexMesh) -> list[list[int]]:
    """The slow, obvious version."""
    triangles, quad = [], []
    for hexa in mesh.hexes:
        for corners in hexa[ABAQUS]:
            number = np.flatnonzero((np.sort(mesh.quads) == np.sort(corners)).all(axis=1))
            if len(number):
                triangles += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
                quad += [int(number[0])] * 2
    sizes = np.cross(*np.moveaxis(np.diff(mesh.vertices[triangles], axis=1), 1, 0))
    assume(np.abs(sizes).max(axis=1).min() > 0)
    found = {
        tuple(sorted((quad[i], quad[j])))
        for i in range(len(triangles))
        for j in range(i)
        if not set(triangles[i]) & set(triangles[j])
        and meet(mesh.vertices[triangles[i]], mesh.vertices[triangles[j]])
    }
    return [list(pair) for pair in sorted(found)]


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_equals_a_linear_program_for_each_pair(seed):
    """On small integers, so that contacts and overlaps within a plane are met too."""
    rng = np.random.default_rng(seed)
    vertices, hexes = unit_cubes(2, 1, 1)
    apart = both(hex_mesh(3 * vertices, hexes), block((1, 1, 1), (4, 4, 4)))
    mesh = hex_mesh(apart.vertices + rng.integers(-1, 2, apart.vertices.shape), apart.hexes)
    assert crossings(mesh).tolist() == every_pair(mesh)
