"""Fields of creases and cheapest paths on them, compared with simple implementations."""

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from polycube.fitting.creases import paths, routing
from polycube.fitting.problem import FitProblem
from polycube.surface.fit_target import target
from polycube.types import Polycube, TriMesh
from tests.fixtures.polycubes import cut


@pytest.fixture(scope="module")
def perturbed() -> tuple[FitProblem, np.ndarray, routing.Net]:
    """A unit cube of hexes on a cube, perturbed so that no two paths have the same cost."""
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    solid = trimesh.creation.box((1, 1, 1))
    problem = FitProblem(cut(cube, 0.125), target(TriMesh(solid.vertices, solid.faces)), 100)
    rng = np.random.default_rng(0)
    x = problem.mesh.vertices - 0.5 + 0.02 * rng.normal(size=problem.mesh.vertices.shape)
    x = problem.target.to_unit(x)
    return problem, x, routing.net(problem, x)


@pytest.mark.slow
def test_shortest_paths_are_those_of_scipy():
    rng = np.random.default_rng(1)
    for _ in range(20):
        start, end = rng.integers(0, 30, (2, 90))
        start, end = np.unique(np.stack([start, end])[:, start != end], axis=1)
        cost, taken = rng.random(len(start)), rng.random(30) < 0.2
        first = np.searchsorted(start, np.arange(31))
        a, b = rng.choice(30, 2, replace=False)
        net = routing.Field(np.arange(30), first, end, cost)
        path, total = routing._between(net, a, b, taken)
        free = ~taken
        free[[a, b]] = True
        used = free[start] & free[end]
        graph = coo_matrix((cost[used], (start[used], end[used])), shape=(30, 30)).tocsr()
        expected = dijkstra(graph, indices=a)[b]
        assert total == pytest.approx(expected)
        if np.isfinite(total):
            assert path[0] == a and path[-1] == b and not taken[path[1:-1]].any()
            steps = np.asarray(graph[path[:-1], path[1:]]).ravel()
            assert steps.sum() == pytest.approx(total) and (steps > 0).all()


def test_the_field_has_all_edges_within_reach(perturbed):
    problem, x, mesh = perturbed
    for crease in problem.target.features.creases:
        found = routing.field(crease, problem, x, mesh)
        gap = crease.nearest(x)[1]
        is_near = gap < routing.REACH * mesh.size
        assert found.vertex.tolist() == [v for v in problem.outer if is_near[v]]
        start = np.repeat(found.vertex, np.diff(found.first))
        both = {(a, b) for side in problem.sides.tolist() for a, b in (side, side[::-1])}
        wanted = {(a, b) for a, b in both if is_near[a] and is_near[b]}
        assert set(zip(start.tolist(), found.vertex[found.end].tolist(), strict=True)) == wanted
        assert (found.cost > 0).all()


def test_corners_are_assigned_to_the_cheapest_vertices(perturbed):
    """On a cube, the best assignment gives every corner its own cheapest vertex."""
    problem, x, mesh = perturbed
    features = problem.target.features
    placed = paths.place_corners(features, problem, x, mesh)
    for number, corner in enumerate(features.corners):
        cost = np.full(len(x), np.inf)
        for v in problem.outer:
            gap = np.linalg.norm(x[v] - corner)
            leaving = mesh.start == v
            if gap < routing.REACH * mesh.size[v]:
                cost[v] = (gap / mesh.size[v]) ** 2
                least = []
                for crease in features.creases:
                    if number in crease.ends:
                        sign = 1 if crease.ends[0] == number else -1
                        arc = 0.02 if sign > 0 else crease.length - 0.02
                        place, _, inside = crease.at(np.array([arc]))
                        direction = (place[0] - corner) / np.linalg.norm(place[0] - corner)
                        crowded = routing.crowding(inside, mesh.hexes[leaving])
                        askew = 1 - mesh.run[leaving] @ direction
                        least.append((2 * askew + crowded).min())
                cost[v] += np.mean(least)
        assert placed[number] == cost.argmin()
