"""Hex sizes at points of a surface, from requests at its faces."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from polycube.hexmesh.cad_faces import model_sets
from polycube.hexmesh.generation.requests import Request
from polycube.hexmesh.generation.requests_met import check_requests, wall_of
from polycube.hexmesh.hex_counts import curve_length, rims
from polycube.surface.fit_target import target
from polycube.surface.measures import diagonal, face_normals, spread
from polycube.types import TriMesh

SAMPLES = 5_000  # number of points on a face
CHORDS = 100  # number of these points from which chords through the part are computed
START = 1e-6  # of a diagonal: closer hits belong to the face itself


class WantedSizes(NamedTuple):
    """A field of sizes, given at points of the surface."""

    points: np.ndarray  # (N, 3) at unit scale
    sizes: np.ndarray  # (N,) edge lengths, in diagonals


def wanted_sizes(surface: TriMesh, requests: Sequence[Request]) -> WantedSizes:
    """Find the sizes that the requests need on their faces.

    The size is the length of the shortest rim divided by the number of edges, the median chord from
    the face to the opposite side divided by the number of hexes, or the requested size. Raises
    InputError if the surface does not have a name.
    """
    check_requests(surface, requests)
    goal = target(surface)
    points, sizes = [np.zeros((0, 3))], [np.zeros(0)]
    for request in requests:
        sets = model_sets(surface)
        faces = surface.faces[sets[wall_of(sets, request)]]
        size = request.wanted(surface)
        if request.kind == "around":
            curves = rims(surface.vertices, faces)
            size = min(curve_length(surface.vertices, curve) for curve in curves) / size
        wall = TriMesh(surface.vertices, faces)
        own, face = spread(wall, SAMPLES)
        if request.kind == "through":
            subset = slice(None, None, SAMPLES // CHORDS)
            normals = face_normals(wall)[face]
            size = float(np.median(_chords(surface, own[subset], -normals[subset]))) / size
        points.append(goal.to_unit(own))
        sizes.append(np.full(len(own), size / goal.scale))
    return WantedSizes(np.concatenate(points), np.concatenate(sizes))


def _chords(surface: TriMesh, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(N,) distance from points (N, 3) along directions (N, 3) to the next triangle of the surface.

    It is the diagonal if there is none.
    """
    import igl

    size, found = diagonal(surface), []
    for point, direction in zip(points, directions, strict=True):
        hits = igl.ray_mesh_intersect(point, direction, surface.vertices, surface.faces) or ()
        found.append(min((t for _, t, _, _ in hits if t > START * size), default=size))
    return np.array(found)
