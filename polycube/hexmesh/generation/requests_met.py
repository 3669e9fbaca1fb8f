"""Check requested numbers of hexes against a surface and a mesh; the sizes that they need."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import NamedTuple

import numpy as np

from polycube.errors import InputError
from polycube.hexmesh.cad_faces import model_sets, quads_of_sets
from polycube.hexmesh.generation.requests import Request
from polycube.hexmesh.hex_counts import around, curve_length, edge_length, rims, through
from polycube.hexmesh.named_sets import kind_of, listed
from polycube.surface.fit_target import target
from polycube.surface.measures import diagonal, face_normals, spread
from polycube.types import HexMesh, TriMesh

NEAR_NAMES = 3  # number of similar names in an error message
SAMPLES = 5_000  # number of points on a face
CHORDS = 100  # number of these points from which chords through the part are computed
START = 1e-6  # of a diagonal: closer hits belong to the face itself


def check_requests(surface: TriMesh, requests: Sequence[Request]) -> None:
    """Raise InputError if the surface lacks a requested name, or if a face has no rim."""
    sets = model_sets(surface) if requests else {}
    for request in requests:
        if request.at not in sets:
            near = get_close_matches(request.at, sets, NEAR_NAMES)
            what = f"the part has no face or hole {request.at!r}"
            meant = f"did you mean {' or '.join(near)}; " if near else ""
            have = f"there are {listed(sets)}" if sets else "no part of this surface has a name"
            raise InputError(what, "meshing.at", meant + have)
        wall = sets[wall_of(sets, request)]
        if request.kind == "around" and not rims(surface.vertices, surface.faces[wall]):
            what = f"{request.at} has no border along which hexes can be counted"
            raise InputError(what, "meshing.at", "name a hole or a face with a border")


def wall_of(sets: Mapping[str, np.ndarray], request: Request) -> str:
    """Name of the set to count on: for hexes around a face of a hole, the hole.

    A hole may consist of several CAD faces, none of which is closed around it.
    """
    if request.kind == "around":
        for name, own in sets.items():
            if kind_of(name) == "hole" and np.isin(sets[request.at], own).all():
                return name
    return request.at


def reached(mesh: HexMesh, surface: TriMesh, requests: Sequence[Request]) -> list[float | None]:
    """Count the hexes of a mesh for each request.

    Returns edges on the rim; hexes through the wall, the median over the quads of the face; median
    edge length on the face, in model units. None if the face has no quads.
    """
    if not requests:
        return []
    names, on_model = quads_of_sets(mesh, surface), model_sets(surface)
    count = through(mesh)[0]
    found: list[float | None] = []
    for request in requests:
        quads = names[wall_of(on_model, request)]
        if not len(quads):
            found.append(None)
        elif request.kind == "around":
            found.append(float(around(mesh, quads)))
        elif request.kind == "through":
            found.append(float(np.median(count[quads])))
        else:
            found.append(edge_length(mesh, quads))
    return found


def missing(mesh: HexMesh, surface: TriMesh, requests: Sequence[Request]) -> list[int]:
    """Number of missing hexes of each request, negative for superfluous ones.

    More edges around a rim than requested are permitted: a lattice cannot have every number.
    """
    found = []
    for request, has in zip(requests, reached(mesh, surface, requests), strict=True):
        off = 0.0 if has is None else request.wanted(surface) - has
        counts = request.kind == "through" or (request.kind == "around" and off > 0)
        found.append(round(off) if counts else 0)
    return found


def unmet(mesh: HexMesh, surface: TriMesh, requests: Sequence[Request]) -> list[str]:
    """One sentence for each request that the mesh does not meet."""
    templates = {
        "around": "{:g} edges round {} instead of {:g}",
        "through": "{:g} hexes through the wall at {} instead of {:g}",
        "size": "edges of {:.3g} at {} instead of {:.3g}",
    }
    found = []
    for request, has in zip(requests, reached(mesh, surface, requests), strict=True):
        if has is None:
            found.append(f"the mesh has no quad on {request.at}, which meshing.at requests")
        elif not request.is_met(surface, has):
            shortfall = templates[request.kind].format(has, request.at, request.wanted(surface))
            found.append(f"meshing.at: the mesh has {shortfall}")
    return found


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
