"""Where meshes agree, and the mesh of all solids."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.assembly.combined import agreements, combined
from polycube.assembly.contacts import Contact
from polycube.hexmesh.connectivity import check_conforming
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from tests.fixtures.blocks import block

ENDS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


def meet(first, second, area, f=2, g=1):
    [found] = agreements(first, second, [Contact(f, g, area, 1.0)])
    return found


def test_equal_sides_agree_and_become_one():
    first, second = block([0, 0, 0], (2, 3, 4)), block([2, 0, 0], (5, 3, 4), 1)
    found = meet(first, second, 12)
    assert found.is_covered and found.quads == (12, 12) and len(found.pairs) == 12
    assert found.area == pytest.approx(12) and len(found.vertices) == 4 * 5
    a, b = found.vertices.T
    np.testing.assert_array_equal(first.vertices[a], second.vertices[b])
    mesh = combined({0: first, 1: second}, ["a", "b"], [(0, 1, found.vertices)])
    check_conforming(mesh)
    assert len(mesh.vertices) == 8 * 4 * 5 and len(mesh.hexes) == 7 * 12
    np.testing.assert_array_equal(mesh.cell, np.repeat([0, 1], [24, 60]))
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() == pytest.approx(1)
    assert len(mesh.sets) == 10 and "a_cad_face_2" not in mesh.sets
    for name, own in mesh.sets.items():
        given = {"a": first, "b": second}[name[0]]
        places = given.vertices[given.quads[given.sets[name[2:]]]].mean(axis=1)
        np.testing.assert_array_equal(mesh.vertices[mesh.quads[own]].mean(axis=1), places)


def test_the_ends_of_the_whole_are_those_of_the_outermost_solids():
    """A block of height 4 beside one of height 3 that starts at the same z."""
    blocks = [block([0, 0, 0], (2, 3, 4)), block([2, 0, 0], (5, 3, 3), 1)]
    named = [
        replace(each, sets={end: each.sets[f"cad_face_{k}"] for k, end in enumerate(ENDS, 1)})
        for each in blocks
    ]
    mesh = combined(dict(enumerate(named)), ["a", "b"], [])
    areas = {end: len(mesh.sets[end]) for end in ENDS}
    assert areas == dict(zip(ENDS, [12, 9, 2 * 4 + 5 * 3, 2 * 4 + 5 * 3, 6 + 15, 6], strict=True))
    for k, end in enumerate(ENDS):
        at = mesh.vertices[mesh.quads[mesh.sets[end]]][..., k // 2]
        assert (at == (0, 7, 0, 3, 0, 4)[k]).all()
    assert len(mesh.sets["b_z_max"]) == 15


def test_ties_have_the_names_of_the_sets_of_the_whole():
    first, second = block([0, 0, 0], (2, 3, 4)), block([2, 0, 0], (5, 3, 4), 1)
    ties = [((1, "cad_face_1"), (0, "cad_face_2")), ((1, "cad_face_9"), (0, "cad_face_2"))]
    mesh = combined({0: first, 1: second}, ["a", "b"], [], ties)
    assert mesh.ties == (("b_cad_face_1", "a_cad_face_2"),)  # there is no set of face 9


def test_a_small_side_agrees_with_a_part_of_a_large_one():
    first, second = block([0, 0, 0], (2, 5, 5)), block([2, 1, 1], (3, 2, 3), 1)
    found = meet(first, second, 6)
    assert found.is_covered and found.quads == (25, 6) and found.area == pytest.approx(6)
    mesh = combined({0: first, 1: second}, ["a", "b"], [(0, 1, found.vertices)])
    check_conforming(mesh)
    assert len(mesh.sets["a_cad_face_2"]) == 25 - 6
    assert not found.binds_first  # the small side, all of which is in contact


def test_a_tie_binds_the_finer_of_equal_faces():
    coarse, fine = block([0, 0, 0], (2, 3, 4)), block([0, 0, 0], (4, 6, 8), 1)
    half = replace(fine, vertices=fine.vertices / 2 + np.array([2, 0, 0]))
    assert not meet(coarse, half, 12).binds_first
    assert meet(half, coarse, 12, 1, 2).binds_first


def test_ties_of_two_solids_bind_nodes_of_the_same_one():
    """Else a node between two contacts would be bound in one tie and bind others in the other."""
    first, second = block([0, 0, 0], (2, 3, 4)), block([2, 0, 0], (5, 3, 3), 1)
    pair = [Contact(2, 1, 9.0, 1.0), Contact(4, 4, 8.0, 1.0)]
    alone = [agreements(first, second, [each])[0].binds_first for each in pair]
    assert alone == [False, True]  # the smaller face: 12 and 9, 8 and 15
    assert [each.binds_first for each in agreements(first, second, pair)] == [True, True]


@pytest.mark.parametrize(
    ("low", "counts", "common"),
    [
        ([2, 0.5, 0], (3, 3, 4), 0),  # shifted by half a quad
        ([2, 1, 0], (3, 3, 4), 8),  # by a whole side: they overlap in two thirds
    ],
)
def test_meshes_do_not_agree_unless_their_quads_cover_the_contact(low, counts, common):
    first, second = block([0, 0, 0], (2, 3, 4)), block(low, counts, 1)
    found = meet(first, second, 12)
    assert not found.is_covered and len(found.pairs) == common
    assert meet(first, second, 8).is_covered == (common == 8)


def test_vertices_that_are_near_are_one_and_in_the_middle():
    first, second = block([0, 0, 0], (1, 1, 1)), block([1, 0, 0], (1, 1, 1), 1)
    near = replace(second, vertices=second.vertices + np.array([0.01, 0, 0]))
    found = meet(first, near, 1)
    assert found.is_covered
    mesh = combined({0: first, 1: near}, ["a", "b"], [(0, 1, found.vertices)])
    assert sorted(set(mesh.vertices[:, 0])) == pytest.approx([0, 1.005, 2.01])
    apart = replace(second, vertices=second.vertices + np.array([0.03, 0, 0]))
    assert not meet(first, apart, 1).is_covered


def test_a_face_without_quads_agrees_with_nothing():
    first, second = block([0, 0, 0], (1, 1, 1)), block([1, 0, 0], (1, 1, 1), 1)
    assert not meet(first, second, 1, f=7).is_covered


def test_three_blocks_round_an_edge_share_its_vertices():
    blocks = [block([0, 0, 0], (2, 2, 2)), block([2, 0, 0], (2, 2, 2), 1)]
    blocks.append(block([0, 2, 0], (4, 2, 2), 2))
    sides = {(0, 1): (2, 1), (0, 2): (4, 3), (1, 2): (4, 3)}
    joints = [(i, j, meet(blocks[i], blocks[j], 4, *s).vertices) for (i, j), s in sides.items()]
    mesh = combined(dict(enumerate(blocks)), ["a", "b", "c"], joints)
    check_conforming(mesh)
    assert len(mesh.vertices) == 5 * 5 * 3


def test_solids_that_are_apart_and_one_without_a_mesh_keep_their_numbers():
    first, second = block([0, 0, 0], (1, 1, 1)), block([5, 0, 0], (2, 1, 1), 1)
    mesh = combined({0: first, 2: second}, ["a", "b", "c"], [])
    np.testing.assert_array_equal(mesh.cell, [0, 2, 2])
    np.testing.assert_array_equal(mesh.vertices, np.vstack([first.vertices, second.vertices]))
    assert len(mesh.quads) == 6 + 10


def test_names_of_solids_and_sets_never_become_one_set():
    """Solid `a` with `b_x` and solid `a_b` with `x`, and a set of nodes of each."""
    first, second = block([0, 0, 0], (1, 1, 1)), block([5, 0, 0], (1, 1, 1))
    sides = first.sets["cad_face_1"], second.sets["cad_face_2"]
    first = replace(first, sets={"b_x": sides[0]}, cad_names={"b_x": "b x"}, unit="in")
    second = replace(second, sets={"x": sides[1]}, node_sets={"edge_e": second.hexes[0, :2]})
    mesh = combined({0: first, 1: second}, ["a", "a_b"], [])
    assert list(mesh.sets) == ["a_b_x", "a_b_x__2"] and mesh.cad_names == {"a_b_x": "b x"}
    assert [mesh.vertices[mesh.quads[own], 0].mean() for own in mesh.sets.values()] == [0, 6]
    [nodes] = mesh.node_sets.values()
    np.testing.assert_array_equal(
        mesh.vertices[nodes], second.vertices[np.sort(second.hexes[0, :2])]
    )
    assert mesh.unit == "in"
