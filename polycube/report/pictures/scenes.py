"""Scenes of the pictures, as coloured polygons and lines; without drawing them.

One of them is a sheet of the structures proposed for a part.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from polycube.hexmesh.background.columns import feet
from polycube.hexmesh.connectivity import FACES, exposed, quad_edges
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.pictures import colours as palette
from polycube.report.pictures.colours import AXIS_COLOURS, CELLS, SURFACE, ramp, rgb
from polycube.report.pictures.fields import tessellate
from polycube.report.pictures.render import EYE, Layer, Scene, view
from polycube.structure.lattice import boundary
from polycube.surface.measures import face_normals
from polycube.types import HexMesh, Labels, Polycube, Ranked, RoughMap, Spline, TriMesh

SHARP = np.cos(np.radians(30))  # smallest angle between faces at a drawn line
MOST = 8  # largest number
COLUMNS = 4
APART = 1.1  # distance between the centres of two polycubes, in diagonals


def input_surface(surface: TriMesh) -> Scene:
    """The input surface with its sharp edges."""
    sharp = sharp_edges(surface.faces, face_normals(surface))
    colours = rgb((SURFACE,) * len(surface.faces))
    return [Layer(surface.vertices, surface.faces, colours, sharp, smooth=True)]


def sharp_edges(polygons: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(L, 2) edges between polygons (P, K) with unit normals (P, 3) of different directions."""
    edges, pair = quad_edges(polygons, is_closed=False)
    return edges[np.einsum("ij,ij->i", normals[pair[:, 0]], normals[pair[:, 1]]) < SHARP]


def labelled(surface: TriMesh, labels: Labels) -> Scene:
    """The surface with a colour per polycube axis, and a line around every patch."""
    edges, pair = quad_edges(surface.faces, is_closed=False)
    border = edges[labels.patch[pair[:, 0]] != labels.patch[pair[:, 1]]]
    return [Layer(surface.vertices, surface.faces, rgb(AXIS_COLOURS)[labels.axis], border)]


def polycube_faces(polycube: Polycube, rough_map: RoughMap | None = None) -> Scene:
    """The polycube with a colour per axis, and a line around every planar face.

    With its rough map it is rotated as the model, so that it shows the same sides.
    """
    faces = boundary(polycube)
    edges, pair = quad_edges(faces.quads, is_closed=False)
    border = edges[faces.patch[pair[:, 0]] != faces.patch[pair[:, 1]]]
    points = faces.vertices if rough_map is None else faces.vertices @ _turn(rough_map).T
    return [Layer(points, faces.quads, rgb(AXIS_COLOURS)[faces.axis], border)]


def section(blocks: HexMesh) -> Scene:
    """The quads of the section of a structure of columns, each with a colour per hexes above it."""
    quads, number = feet(blocks)
    rank = np.unique(number, return_inverse=True)[1]
    return [Layer(blocks.vertices, quads, rgb(CELLS)[rank % len(CELLS)], outlined=True)]


def _turn(rough_map: RoughMap) -> np.ndarray:
    """(3, 3) rotation closest to the linear part of the map."""
    pairs = ((1, 2), (0, 2), (0, 1))  # the axes across each axis
    ends = [np.take(rough_map.positions, [0, -1], k).mean(axis=pairs[k]) for k in range(3)]
    along = np.stack([end[1] - end[0] for end in ends], 1)
    left, _, right = np.linalg.svd(along / np.linalg.norm(along, axis=0))
    return left @ right


def hex_outside(mesh: HexMesh) -> Scene:
    """The boundary of the hex mesh, each quad coloured by the quality of its hex."""
    return [_quality_skin(mesh, np.arange(len(mesh.hexes)))]


def hex_cut(mesh: HexMesh) -> Scene:
    """The hexes behind a plane through the centre, coloured by their quality.

    The plane is parallel to the two longer sides of the bounding box; the hexes in front are
    removed.
    """
    axis = int(np.argmin(np.ptp(mesh.vertices, axis=0)))
    middle = (mesh.vertices.max(0) + mesh.vertices.min(0))[axis] / 2
    centre = mesh.vertices[mesh.hexes].mean(1)[:, axis]
    behind = np.sign(EYE[axis]) * (centre - middle) <= 1e-9 * np.ptp(mesh.vertices)
    return [_quality_skin(mesh, np.flatnonzero(behind))]


def deviation(mesh: HexMesh, distance: np.ndarray) -> Scene:
    """The boundary, each quad coloured by its distance (Q,) from the input."""
    colours = ramp(distance / max(distance.max(), 1e-300), palette.DEVIATION_COLOURS)
    return [Layer(mesh.vertices, mesh.quads, colours, outlined=True)]


def decomposed(mesh: HexMesh, apart: float = 0.25) -> Scene:
    """The hexes of each grid cell in a separate colour, moved apart; a layer for each colour.

    apart : displacement of a cell, relative to its distance from the centre of the mesh
    """
    cells, of = np.unique(mesh.cell, return_inverse=True)
    n, middle = len(mesh.vertices), mesh.vertices[mesh.hexes].mean(axis=1)
    shift = [middle[of == k].mean(axis=0) - middle.mean(axis=0) for k in range(len(cells))]
    quads, owner = exposed(mesh.hexes + n * of[:, None])  # a vertex for each cell that has it
    number, scene = (cells % len(CELLS))[of[owner]], []
    for k in np.unique(number):
        used, local = np.unique(quads[number == k], return_inverse=True)
        points = mesh.vertices[used % n] + apart * np.array(shift)[used // n]
        polygons = local.reshape(-1, 4)
        scene.append(Layer(points, polygons, rgb((CELLS[k],) * len(polygons)), outlined=True))
    return scene


def worst_hex(mesh: HexMesh) -> Scene:
    """The hex of lowest quality in a transparent mesh, at the intersection of three lines."""
    hexa = mesh.hexes[np.argmin(scaled_jacobian(mesh.vertices, mesh.hexes))]
    glass = rgb((SURFACE,) * len(mesh.quads))
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    cross = np.repeat(mesh.vertices[hexa].mean(0)[None], 6, axis=0)
    cross[[0, 2, 4], [0, 1, 2]], cross[[1, 3, 5], [0, 1, 2]] = low, high
    points = np.concatenate([mesh.vertices[hexa], cross])
    lines = np.array([[8, 9], [10, 11], [12, 13]])
    return [
        Layer(mesh.vertices, mesh.quads, glass, opacity=0.25, smooth=True),
        Layer(points, FACES, rgb((palette.WORST,) * 6), lines, outlined=True),
    ]


def spline_boundary(spline: Spline) -> Scene:
    """The boundary of the spline solid with the edges of its Bezier elements."""
    skin = tessellate(spline)
    return [skin.layer(rgb((SURFACE,) * len(skin.quads)))]


def _quality_skin(mesh: HexMesh, chosen: np.ndarray) -> Layer:
    quads, owner = exposed(mesh.hexes[chosen])
    quality = scaled_jacobian(mesh.vertices, mesh.hexes[chosen])[owner]
    return Layer(mesh.vertices, quads, ramp(quality, palette.QUALITY_COLOURS), outlined=True)


def distinct(ranked: Sequence[Ranked]) -> list[Ranked]:
    """The best proposals of a ranking with different polycubes, at most `MOST`."""
    found: dict[str, Ranked] = {}
    for entry in ranked:
        if entry.candidate.blocks is None:
            found.setdefault(entry.candidate.key, entry)
    return list(found.values())[:MOST]


def sheet(shown: Sequence[Ranked]) -> Scene:
    """Polycubes of diagonal 1 in rows of `COLUMNS`, oriented as the model."""
    scene = []
    for number, entry in enumerate(shown):
        [shape] = polycube_faces(entry.candidate.polycube, entry.candidate.rough_map)
        low, high = shape.points.min(axis=0), shape.points.max(axis=0)
        centred = (shape.points - (low + high) / 2) / np.linalg.norm(high - low)
        row, column = divmod(number, COLUMNS)
        shift = APART * (column * view()[0] - row * view()[1])
        scene.append(replace(shape, points=centred + shift, line_width=2))
    return scene
