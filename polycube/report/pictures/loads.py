"""Picture of supports and loads: cones at held faces, arrows at loaded ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial, reduce
from operator import add
from typing import TYPE_CHECKING

import numpy as np

from polycube.analysis.boundary_sets import quads_of
from polycube.analysis.problem import Conduction, Prescribed, Problem, Statics
from polycube.hexmesh.face_groups import Faces, measure
from polycube.report.pictures.colours import HELD, LOADED, SURFACE, rgb
from polycube.report.pictures.render import Layer, Scene, from_both_sides
from polycube.report.pictures.scenes import sharp_edges
from polycube.surface.measures import frame, unit
from polycube.types import HexMesh
from polycube.units import METRES

if TYPE_CHECKING:
    from trimesh import Trimesh

CONE, ARROW = 0.035, 0.11  # lengths of the symbols, as shares of the diagonal
SLENDER = 0.3  # radius of a cone, as a share of its length
SHAFT = 0.07  # radius of the shaft of an arrow, as a share of the length of the arrow
HEAD = 0.35  # share of the head in the length of an arrow
SIDES = 12  # of a cone
MOST = 10  # symbols at a place
SPACING = 0.045  # least distance of the symbols at a place, as a share of the diagonal
WEAK = 0.05  # share of the largest traction of a load below which there is no arrow


def supports_and_loads(mesh: HexMesh, problem: Problem) -> Scene:
    """The part from both sides, with held and loaded faces and their symbols."""
    faces = measure(mesh.vertices[mesh.quads])
    size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    is_held, is_loaded = (np.zeros(len(mesh.quads), int) for _ in range(2))
    cones = []
    for support in problem.supports:
        own = quads_of(mesh, support.place)
        is_held[own] = 1
        if not isinstance(problem, Conduction):
            cones += _held(support, faces, spread(faces, own, SPACING * size), size)
    for place, _ in _forces(problem):
        is_loaded[quads_of(mesh, place)] = 1
    pushed = pushes(mesh, problem, faces, SPACING * size)
    arrows = [_pushed(faces.middle[q], faces.normal[q], way, ARROW * size) for q, way in pushed]
    if isinstance(problem, Statics) and any(problem.acceleration):
        # in front of the part, as it acts on all of it
        way = np.array(problem.acceleration) / np.linalg.norm(problem.acceleration)
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        tip = (low + high) / 2 - (np.abs(way) @ (high - low) / 2 + 0.02 * size) * way
        arrows.append(_arrow(tip - 1.5 * ARROW * size * way, tip))
    colours = rgb((SURFACE, HELD, LOADED))[np.where(is_loaded, 2, is_held)]
    sharp = sharp_edges(mesh.quads, unit(faces.normal))
    part = Layer(mesh.vertices, mesh.quads, colours, sharp, ambient=0.5)
    return from_both_sides([part, *_layer(cones, HELD), *_layer(arrows, LOADED)])


def pushes(
    mesh: HexMesh, problem: Problem, faces: Faces, spacing: float
) -> Iterator[tuple[int, np.ndarray]]:
    """Quads at which a load has an arrow, and its vector there."""
    for place, vectors_at in _forces(problem):
        own = quads_of(mesh, place)
        vectors = np.zeros((len(mesh.quads), 3))
        vectors[own] = vectors_at(faces.middle[own], unit(faces.normal[own]), faces.area[own])
        lengths = np.linalg.norm(vectors, axis=1)
        acting = np.flatnonzero(lengths > WEAK * lengths.max())
        for quad in spread(faces, acting, spacing) if len(acting) else ():
            yield quad, vectors[quad]


def _forces(problem: Problem) -> list[tuple[object, Callable[..., np.ndarray]]]:
    """Place of each load, and its direction from points, normals and areas of faces."""
    found: list[tuple[object, Callable[..., np.ndarray]]] = []
    if isinstance(problem, Statics):
        metre = METRES[problem.units]
        found += [(load.place, partial(load.traction_at, metre=metre)) for load in problem.loads]
        for support in problem.supports:
            if any(support.values):
                vector = np.zeros(3)
                vector[list(support.components)] = support.values
                found.append((support.place, lambda *_, way=vector: way))
    if isinstance(problem, Conduction):
        for flow in problem.flows:
            found.append((flow.place, lambda _, n, __, flux=flow.flux: -flux * n))
    return found


def spread(faces: Faces, own: np.ndarray, spacing: float, most: int = MOST) -> np.ndarray:
    """At most `most` of the faces `own`, as far apart as possible and at least by `spacing`."""
    places = faces.middle[own]
    chosen = [int(np.linalg.norm(places - places.mean(axis=0), axis=1).argmax())]
    apart = np.linalg.norm(places - places[chosen[0]], axis=1)
    while len(chosen) < most and apart.max() > spacing:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(places - places[chosen[-1]], axis=1))
    return own[chosen]


def _held(support: Prescribed, faces: Faces, quads: np.ndarray, size: float) -> list[Trimesh]:
    """Cones that touch the faces: along the normal, or along each axis of a partial support."""
    prescribed = zip(support.components, support.values, strict=True)
    held = [axis for axis, value in prescribed if not value]
    found = []
    for quad in quads:
        normal = faces.normal[quad] / float(np.linalg.norm(faces.normal[quad]))
        axes = np.eye(3) * np.where(normal < -1e-9, -1, 1)  # outwards
        ways = [normal] if len(held) == 3 else axes[held]
        tip = faces.middle[quad]
        found += [_cone(tip + CONE * size * way, tip, SLENDER * CONE * size) for way in ways]
    return found


def _pushed(place: np.ndarray, normal: np.ndarray, vector: np.ndarray, length: float) -> Trimesh:
    """An arrow outside the part that touches a face with its tip or, if it pulls, its end."""
    way = length * vector / float(np.linalg.norm(vector))
    return _arrow(place, place + way) if way @ normal > 0 else _arrow(place - way, place)


def _arrow(start: np.ndarray, end: np.ndarray) -> Trimesh:
    from trimesh.creation import cylinder

    length = float(np.linalg.norm(end - start))
    neck = end - HEAD * (end - start)
    shaft = cylinder(SHAFT * length / 2, sections=SIDES, segment=[start, neck])
    return shaft + _cone(neck, end, SLENDER * HEAD * length)


def _cone(start: np.ndarray, end: np.ndarray, radius: float) -> Trimesh:
    """A cone with its base at the start and its tip at the end."""
    from trimesh.creation import cone

    length = float(np.linalg.norm(end - start))
    axes = np.eye(4)
    axes[:3, :3], axes[:3, 3] = frame((end - start) / length).T, start
    return cone(radius, length, SIDES, transform=axes)


def _layer(symbols: list[Trimesh], colour: str) -> Scene:
    if not symbols:
        return []
    shown = reduce(add, symbols)
    points, triangles = np.asarray(shown.vertices), np.asarray(shown.faces)
    return [Layer(points, triangles, rgb((colour,) * len(triangles)), ambient=0.5)]
