"""Names of parts of the boundary of simple solids."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.analysis.boundary_sets import sets_of_sides
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.face_groups import ENDS, ends_and_holes
from polycube.hexmesh.named_sets import boundary_sets, listed, may_name, sets_of_spline
from polycube.io.hex_meshes import patches
from polycube.registry import build
from polycube.spline.spaces.hierarchy import coarsest, finer_level, hierarchical_spline
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.fixtures.hierarchies import space_on


def with_patches(mesh):
    return hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh))


def names_of(mesh):
    """The numbers of the patches of each end and hole."""
    found = ends_and_holes(mesh.vertices, mesh.quads, mesh.patch)
    return {name: np.unique(mesh.patch[quads]).tolist() for name, quads in found.items()}


def without(counts, taken):
    """Box of unit hexes without those whose centres are in `taken`."""
    box = hex_box(counts, counts)
    middle = box.vertices[box.hexes].mean(axis=1)
    gone = (np.abs(middle[:, None] - np.array(taken)) < 0.1).all(axis=2).any(axis=1)
    used, local = np.unique(box.hexes[~gone], return_inverse=True)
    return with_patches(hex_mesh(box.vertices[used], local.reshape(-1, 8)))


def test_the_six_sides_of_a_box():
    mesh = with_patches(hex_box((2, 3, 1), (3.0, 2.0, 1.0)))
    sets = boundary_sets(mesh)
    assert list(sets) == [*ENDS, *(f"patch_{k}" for k in range(6))]
    for end, name in enumerate(ENDS):
        corners = mesh.vertices[mesh.quads[sets[name]]]
        place = [0.0, (3.0, 2.0, 1.0)[end // 2]][end % 2]
        assert (corners[:, :, end // 2] == place).all() and len(corners) > 0
    numbers = np.concatenate([sets[f"patch_{k}"] for k in range(6)])
    assert sorted(numbers) == list(range(len(mesh.quads)))


@pytest.mark.parametrize(("layers", "walls"), [(1, 4), (2, 5)], ids=["hole", "pocket"])
def test_walls_of_a_hole_and_of_a_pocket(layers, walls):
    mesh = without((3, 3, layers), [(1.5, 1.5, layers - 0.5)])
    names = names_of(mesh)
    assert set(names) == {*ENDS, "hole_1"}
    assert len(names["hole_1"]) == walls
    inside = np.setdiff1d(mesh.patch, np.concatenate([names[end] for end in ENDS]))
    assert names["hole_1"] == inside.tolist()


def test_holes_are_counted_along_x_then_y():
    mesh = without((5, 5, 1), [(1.5, 1.5, 0.5), (1.5, 3.5, 0.5), (3.5, 1.5, 0.5)])
    sets = boundary_sets(mesh)
    middles = [mesh.vertices[mesh.quads[sets[f"hole_{k}"]]].mean(axis=(0, 1)) for k in (1, 2, 3)]
    np.testing.assert_allclose(middles, [(1.5, 1.5, 0.5), (1.5, 3.5, 0.5), (3.5, 1.5, 0.5)])
    assert listed(sets).startswith("x_min, x_max, y_min, y_max, z_min, z_max, hole_1, hole_2, hole")


def test_a_concave_corner_is_no_hole():
    mesh = without((2, 2, 1), [(1.5, 1.5, 0.5)])
    assert len(np.unique(mesh.patch)) == 8
    assert set(names_of(mesh)) == set(ENDS)


def test_a_channel_is_no_hole_and_with_closed_ends_it_is():
    assert set(names_of(without((3, 3, 2), [(1.5, y, 1.5) for y in (0.5, 1.5, 2.5)]))) == set(ENDS)
    closed = without((3, 4, 2), [(1.5, y, 1.5) for y in (1.5, 2.5)])
    assert set(names_of(closed)) == {*ENDS, "hole_1"}


def test_a_neck_between_two_shoulders_is_no_hole():
    ring = [(x, y, 1.5) for x in (0.5, 1.5, 2.5) for y in (0.5, 1.5, 2.5) if (x, y) != (1.5, 1.5)]
    assert set(names_of(without((3, 3, 3), ring))) == set(ENDS)


def test_smooth_solids():
    assert list(boundary_sets(hex_ball(2))) == ["patch_0"]
    rod = with_patches(hex_cylinder(3))
    assert set(names_of(rod)) == {"z_min", "z_max"}


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-6, 6))
def test_names_do_not_depend_on_size_position_and_order(seed, power):
    mesh, rng = without((3, 3, 1), [(1.5, 1.5, 0.5)]), np.random.default_rng(seed)
    order, scale = rng.permutation(len(mesh.quads)), 10.0**power
    points = scale * (mesh.vertices + 100 * rng.normal(size=3))
    found = ends_and_holes(points, mesh.quads[order], mesh.patch[order])
    known = ends_and_holes(mesh.vertices, mesh.quads, mesh.patch)
    assert {name: sorted(order[own]) for name, own in found.items()} == {
        name: own.tolist() for name, own in known.items()
    }


@pytest.mark.parametrize("space", ["h2s", "c0"])
def test_a_spline_refined_somewhere_has_the_sets_of_its_mesh(space):
    mesh = without((3, 3, 1), [(1.5, 1.5, 0.5)])
    mesh = replace(mesh, sets=boundary_sets(mesh))
    maker = build("spline", {"plugin": space})
    coarse = coarsest(space_on(maker, mesh))
    spline = hierarchical_spline([coarse, finer_level(coarse, np.array([0, 4]))])
    assert len(spline.sides) > len(mesh.quads)
    sets = sets_of_spline(spline, mesh)
    assert list(sets) == list(mesh.sets)
    for patch in np.unique(mesh.patch):
        assert sets[f"patch_{patch}"].tolist() == np.flatnonzero(spline.patch == patch).tolist()
    own = sets_of_sides(spline)
    assert all(np.array_equal(sets[name], own[name]) for name in ENDS)


def test_possible_names():
    good = ["x_min", "z_max", "hole_12", "patch_0", "cad_face_3", "cad_top", 7, "7"]
    assert all(map(may_name, good))
    assert not any(map(may_name, ["x_mid", "top", "hole", "hole_", "xx_min", "x_minx", -1, "1.5"]))
