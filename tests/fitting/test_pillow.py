"""Layers of hexes under the boundary."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from polycube.fitting.creases.constraints import match
from polycube.fitting.creases.paths import Route
from polycube.fitting.pillow import layer, regions, smooth_regions
from polycube.fitting.problem import FitProblem
from polycube.fitting.registration import register_mesh
from polycube.hexmesh import connectivity as hexes
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import Target, target
from polycube.types import HexMesh, Polycube, TriMesh
from tests.fixtures.polycubes import cut, ring


def cube() -> HexMesh:
    """Unit cube of 4 x 4 x 4 hexes; patches +x, -x, +y, -y, +z, -z."""
    solid = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    return cut(solid, 0.25)


def smooth_patches(mesh: HexMesh, target: Target, least: float = 0.6) -> np.ndarray:
    """Patches of a fitted mesh of which a part has a border that is smooth on the surface."""
    problem = FitProblem(mesh, target, samples=1)
    x = target.to_unit(mesh.vertices)
    _, taken = smooth_regions(problem, x, match(problem, x), least)
    return np.unique(mesh.patch[taken])


def insert(mesh: HexMesh, patches: np.ndarray, depth: float = 0.5) -> HexMesh:
    """The mesh with an additional layer of hexes under the given patches; see `layer`."""
    return layer(mesh, mesh.patch, np.isin(mesh.patch, patches), depth)


def test_layer_under_the_whole_boundary():
    mesh = insert(cube(), np.arange(6))
    assert len(mesh.hexes) == 64 + 96
    assert hexes.genus(mesh) == 0
    assert volume(mesh) == pytest.approx(1)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0
    assert np.bincount(mesh.patch).tolist() == [16] * 6


def test_every_boundary_hex_under_a_layer_has_one_boundary_face():
    mesh = insert(cube(), np.arange(6))
    _, owner = hexes.exposed(mesh.hexes)
    assert len(np.unique(owner)) == len(owner)


@pytest.mark.parametrize("covered", [[0], [0, 2], [0, 1], [0, 1, 2, 3]])
def test_layer_leaves_through_the_other_patches(covered):
    mesh = insert(cube(), np.array(covered))
    hexes.check_conforming(mesh)
    assert len(mesh.hexes) == 64 + 16 * len(covered)
    assert 1 - 1 / 64 < volume(mesh) <= 1 + 1e-12  # edges between bare patches are cut short
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    for patch, (axis, side) in enumerate([(0, 1), (0, 0), (1, 1), (1, 0), (2, 1), (2, 0)]):
        here = middle[mesh.patch == patch][:, axis]
        assert here == pytest.approx(side, abs=1 / 64)
    inner, _ = hexes.extraordinary_edges(mesh)
    assert (len(inner) > 0) == (covered not in ([0], [0, 1]))  # where two layers meet


def test_boundary_vertices_do_not_move():
    before, after = cube(), insert(cube(), np.arange(6))
    shown = [np.unique(m.vertices[m.quads].reshape(-1, 3), axis=0) for m in (before, after)]
    assert np.array_equal(*shown)


def test_layers_that_would_only_touch_are_joined():
    """Two opposite quadrants of a face: at the middle vertex their layers meet in an edge."""
    mesh = cube()
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    up = mesh.patch == 4
    quadrant = np.where(up, 6 + 2 * (middle[:, 0] > 0.5) + (middle[:, 1] > 0.5), mesh.patch)
    mesh = HexMesh(mesh.vertices, mesh.hexes, mesh.quads, quadrant, mesh.cell)
    layered = insert(mesh, np.array([6, 9]))
    hexes.check_conforming(layered)
    assert len(layered.hexes) == 64 + 16


def test_cells_and_handles_are_kept():
    mesh = cut(ring(), 1 / 6)
    layered = insert(mesh, np.unique(mesh.patch))
    assert hexes.genus(layered) == 1
    assert len(layered.cell) == len(layered.hexes)
    assert set(layered.patch) == set(mesh.patch)


def surface(mesh: trimesh.Trimesh) -> TriMesh:
    return TriMesh(mesh.vertices, mesh.faces)


def test_smooth_patches_of_known_surfaces():
    box = surface(trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]]))
    assert len(smooth_patches(cube(), target(box))) == 0
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.6)
    ball.apply_translation([0.5, 0.5, 0.5])
    assert smooth_patches(cube(), target(surface(ball))).tolist() == [0, 1, 2, 3, 4, 5]


def test_caps_of_a_cylinder_get_no_layer():
    rod = trimesh.creation.cylinder(radius=0.5 * 2**0.5, height=1, sections=64)
    rod.apply_translation([0.5, 0.5, 0.5])
    goal = target(surface(rod))
    assert smooth_patches(register_mesh(cube(), goal, rounds=5), goal).tolist() == [0, 1, 2, 3]


def fitted(solid: Polycube, shape: trimesh.Trimesh) -> tuple[FitProblem, np.ndarray]:
    mesh, goal = cut(solid, 0.125), target(surface(shape))
    return FitProblem(mesh, goal, samples=1), goal.to_unit(mesh.vertices)


def test_regions_of_a_box_are_its_sides_and_get_no_layer():
    solid = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    problem, x = fitted(solid, trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]]))
    region, taken = smooth_regions(problem, x, match(problem, x))
    assert not taken.any()
    assert region.max() == 5
    assert len(np.unique(np.stack([problem.mesh.patch, region]), axis=1).T) == 6


def test_by_angle_a_border_with_two_hexes_on_a_plane_gets_no_layer():
    """One side of a box is two patches: their border is no crease, but the hexes are square."""
    solid = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    mesh, box = cut(solid, 0.125), trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
    halves = (mesh.patch == 4) & (mesh.vertices[mesh.quads].mean(axis=1)[:, 0] > 0.5)
    mesh = replace(mesh, patch=np.where(halves, 6, mesh.patch))
    goal = target(surface(box))
    problem, x = FitProblem(mesh, goal, samples=1), goal.to_unit(mesh.vertices)
    matching = match(problem, x)
    assert smooth_regions(problem, x, matching)[1].sum() == 64
    assert not smooth_regions(problem, x, matching, by_angle=True)[1].any()


def test_by_angle_flat_hexes_get_a_layer():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.6)
    ball.apply_translation([0.5, 0.5, 0.5])
    goal = target(surface(ball))
    mesh = register_mesh(cube(), goal, rounds=10)
    problem, x = FitProblem(mesh, goal, samples=1), goal.to_unit(mesh.vertices)
    assert smooth_regions(problem, x, match(problem, x), by_angle=True)[1].mean() > 0.6


def test_a_single_quad_is_no_region():
    """A path around a single corner quad does not divide the patch."""
    solid = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    problem, x = fitted(solid, trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]]))
    matching = match(problem, x)
    quad = problem.quads[np.flatnonzero((problem.quads == matching.corner[0]).any(axis=1))[0]]
    around = np.roll(quad, -int(np.argmax(quad == matching.corner[0])))[1:]
    short_cut = Route(matching.routes[0].crease, around)
    assert regions(problem, replace(matching, routes=(short_cut,))).max() == 5


def test_a_crease_within_a_patch_divides_it():
    """A roof with a sharp ridge on a box: its one top patch is two regions."""
    solid = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    outline = np.array([[0, 0], [1, 0], [1, 1], [0.5, 1.3], [0, 1]])
    ends = [np.insert(outline, 1, y, axis=1) for y in (0, 1)]
    problem, x = fitted(solid, trimesh.convex.convex_hull(np.concatenate(ends)))
    model = problem.target.to_model(x)
    model[:, 2] *= 1 + 0.3 * (1 - np.abs(2 * model[:, 0] - 1))
    x = problem.target.to_unit(model)
    region, taken = smooth_regions(problem, x, match(problem, x))
    assert not taken.any() and region.max() == 6
    assert len(np.unique(region[problem.mesh.patch == 4])) == 2


def test_a_layer_does_not_end_at_a_concave_crease():
    """An L: without the crease at one end of its floor, floor and end wall are smooth, and the
    wall behind the floor, across the concave crease, goes with them."""
    solid = Polycube(
        np.array([[[1, 1]], [[1, 0]]]),
        [0, 1, 2],
        [0, 1],
        [0, 1, 2],
        (2, 1, 2),
        (*["cube"] * 3, None),
    )
    shape = ell()
    problem, x = fitted(solid, shape)
    matching = match(problem, x)
    assert len(matching.routes) == 18
    middle = np.array([x[route.vertices].mean(axis=0) for route in matching.routes])
    wanted = problem.target.to_unit(np.array([2, 0.5, 1.0]))  # the outer edge of the floor
    gone = int(np.linalg.norm(middle - wanted, axis=1).argmin())
    routes = matching.routes[:gone] + matching.routes[gone + 1 :]
    region, taken = smooth_regions(problem, x, replace(matching, routes=routes))
    centre = problem.target.to_model(x)[problem.quads].mean(axis=1)
    floor = np.isclose(centre[:, 2], 1)
    end, wall = np.isclose(centre[:, 0], 2), np.isclose(centre[:, 0], 1)
    assert np.array_equal(taken, floor | end | wall)
    layered = layer(problem.mesh, region, taken)
    hexes.check_conforming(layered)
    assert scaled_jacobian(layered.vertices, layered.hexes).min() > 0


def ell() -> trimesh.Trimesh:
    """Two unit cubes in a row and one upon the first, as one closed surface."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2.0]])
    points = np.concatenate([np.insert(outline, 1, y, axis=1) for y in (0, 1)])
    faces = [[i, (i + 1) % 6 + 6, (i + 1) % 6] for i in range(6)]
    faces += [[i, i + 6, (i + 1) % 6 + 6] for i in range(6)]
    cap = np.array([[3, 5, 0], [3, 4, 5], [3, 0, 1], [3, 1, 2]])
    return trimesh.Trimesh(points, np.concatenate([faces, cap, cap[:, ::-1] + 6]))
