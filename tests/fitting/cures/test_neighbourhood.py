"""The neighbourhood of a sheet, and the paths that cross the sheet."""

import numpy as np
import pytest

from polycube.fitting.creases.paths import path_sides
from polycube.fitting.cures.fitted import edge_keys, fitted, with_flat_corners
from polycube.fitting.cures.neighbourhood import _runs, neighbourhood, with_detours
from polycube.hexmesh.connectivity import quad_edges
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod


@pytest.fixture(scope="module")
def rod():
    surface, mesh = lattice_on_rod()
    return fitted(mesh, target(surface))


def runs(is_loop: bool, marks: str) -> list[list[int]]:
    return [run.tolist() for run, _, _ in _runs(is_loop, np.array([m == "x" for m in marks]))]


@pytest.mark.parametrize(
    ("is_loop", "marks", "expected"),
    [
        (False, "xxx", [[0, 1, 2, 3]]),
        (True, "xxxx", [[0, 1, 2, 3]]),
        (False, "x.x", [[0, 1], [2, 3]]),
        (True, "xx.x", [[3, 0, 1, 2]]),
        (True, ".xx.xx", [[1, 2, 3], [4, 5, 0]]),
        (False, ".x.", [[1, 2]]),
        (True, "....", []),
    ],
)
def test_runs_of_a_path(is_loop, marks, expected):
    assert runs(is_loop, marks) == expected


def test_a_run_across_the_start_of_a_loop_ends_beyond_its_length():
    [(run, start, end)] = _runs(True, np.array([True, True, False, True]))
    assert run.tolist() == [3, 0, 1, 2]
    assert (start, end) == (3, 6)


def test_detours_are_inserted_between_their_ends():
    path = np.array([5, 6, 7])
    assert with_detours(path, False, {(5, 6): [8, 9]}).tolist() == [5, 8, 9, 6, 7]
    assert with_detours(path, True, {(7, 5): [8]}).tolist() == [5, 6, 7, 8]
    assert with_detours(path, True, {}) is path


def test_a_neighbourhood_has_all_hexes_of_its_moving_vertices(rod):
    near = neighbourhood(rod, np.array([0]))
    moving = near.used[near.moves]
    there = np.isin(rod.mesh.hexes, moving).any(axis=1)
    assert set(np.flatnonzero(there)) == set(near.elements)
    assert near.inside is None
    x = near.problem.mesh.vertices
    assert np.array_equal(x, rod.mesh.vertices[near.used])


@pytest.mark.parametrize("rings", [0, 1])
def test_the_rings_of_a_neighbourhood(rod, rings):
    near = neighbourhood(rod, np.array([0]), rings=rings)
    moving = rod.links.around(rod.mesh.hexes[0], rings)
    assert set(near.used[near.moves]) == set(moving)


def test_a_path_may_have_two_vertices_in_a_part_without_the_edge_between_them(rod):
    """Two hexes far from each other, so that a row of hexes between their parts is in neither."""
    creases = rod.target.followed.creases
    ends = [path_sides(path, creases[number].is_loop) for number, path in rod.paths.items()]
    for other in range(1, len(rod.mesh.hexes)):
        near = neighbourhood(rod, np.array([0, other]))
        sides = np.concatenate([route.sides for route in near.matching.routes])
        number = len(near.used)
        edges = edge_keys(quad_edges(near.problem.mesh.quads, is_closed=False)[0], number)
        assert np.isin(edge_keys(sides, number), edges).all()
        if np.isin(np.concatenate(ends), near.used).all(axis=1).sum() > len(sides):
            return
    pytest.fail("there are no such hexes")


def test_a_sheet_has_new_vertices_that_move_and_paths_on_edges(rod):
    for _, inside in with_flat_corners(rod):
        near = neighbourhood(rod, np.array([0]), inside)
        mesh = near.problem.mesh
        assert len(mesh.hexes) > len(near.elements)
        assert near.moves[len(near.used) :].all()
        edges = edge_keys(quad_edges(mesh.quads, is_closed=False)[0], len(mesh.vertices))
        assert near.matching.routes
        for route in near.matching.routes:
            assert np.isin(edge_keys(route.sides, len(mesh.vertices)), edges).all()


def test_a_pinched_set_has_no_sheet(rod):
    """Two hexes that meet at one vertex, in the middle of the mesh."""
    hexes = rod.mesh.hexes
    is_outer = np.zeros(len(rod.gap), bool)
    is_outer[rod.mesh.quads] = True
    middle = np.flatnonzero(~is_outer[hexes].any(axis=1))
    shared = np.array([[np.isin(hexes[a], hexes[b]).sum() for b in middle] for a in middle])
    one, other = np.argwhere(shared == 1)[0]
    inside = np.isin(np.arange(len(hexes)), middle[[one, other]])
    assert neighbourhood(rod, np.array([0]), inside) is None
