"""Faces of a surface perpendicular to an axis (caps), and along it (walls)."""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from polycube.hexmesh.background.arrangement import cross, to_lines
from polycube.hexmesh.background.background import NoBackgroundError
from polycube.surface.measures import area_vectors, connected, place, unit
from polycube.types import TriMesh

FLAT = 1e-3  # sine of an angle: tolerance for whole faces along the axis or perpendicular to it
FACET = 0.2  # the same for the triangles of a round wall
SAG = 1 / 40  # of a chord: its distance from an arc with a turn of FACET
SHARP = np.radians(20)  # angle between the triangles of two walls without CAD faces


@dataclass(frozen=True, eq=False)
class Triangles:
    """Cached measures of the triangles of a surface."""

    area: np.ndarray  # (F,)
    normals: np.ndarray  # (F, 3) unit vectors
    is_sliver: np.ndarray  # (F,) whether a triangle is too thin for a normal


def triangles(surface: TriMesh, near: float) -> Triangles:
    """Areas and normals; slivers have a height of about `near` or less."""
    vectors = area_vectors(surface)
    area = np.linalg.norm(vectors, axis=1)
    corners = surface.vertices[surface.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return Triangles(area, unit(vectors), 2 * area < 10 * near * longest)


def caps(
    surface: TriMesh, known: Triangles, axis: np.ndarray, near: float
) -> tuple[np.ndarray, np.ndarray]:
    """Whether each triangle is perpendicular to an axis (F,), and whether it is slightly inclined
    (F,).

    Slivers are caps if they are at one height.

    Raises NoBackgroundError if a triangle is too inclined for a wall.
    """
    lean = np.where(known.is_sliver, 0, abs(known.normals @ axis))
    if (inclined := (lean > FACET) & (lean < 1 - FLAT)).any():
        _refuse(surface, np.argmax(inclined * lean * known.area))
    rise = np.ptp((surface.vertices @ axis)[surface.faces], axis=1)
    is_cap = np.where(known.is_sliver, rise < near, (lean > FACET) & (rise < 10 * near))
    if (inclined := (lean > FACET) & ~is_cap).any():
        _refuse(surface, np.argmax(inclined * known.area))
    return is_cap, ~is_cap & (lean > FLAT)


def _refuse(surface: TriMesh, face: np.intp) -> NoReturn:
    where = place(surface, surface.vertices[surface.faces[face]].mean(axis=0))
    raise NoBackgroundError(f"a face is neither parallel nor perpendicular to an axis near {where}")


def wall_of(
    surface: TriMesh, known: Triangles, is_cap: np.ndarray, adjacent: np.ndarray
) -> np.ndarray:
    """(F,) number of the face of each triangle.

    These are the faces of the CAD model, or pieces between sharp edges.

    adjacent : (E, 2) triangles at each edge
    """
    if len(surface.region):
        return 2 * surface.region + is_cap
    turn = np.einsum("nd,nd->n", known.normals[adjacent[:, 0]], known.normals[adjacent[:, 1]])
    same = is_cap[adjacent[:, 0]] == is_cap[adjacent[:, 1]]
    same &= (turn > np.cos(SHARP)) | known.is_sliver[adjacent].any(axis=1)
    return connected(adjacent[same, 0], adjacent[same, 1], len(surface.faces))


def check_walls(
    surface: TriMesh,
    known: Triangles,
    across: np.ndarray,
    wall: np.ndarray,
    leans: np.ndarray,
    borders: tuple[np.ndarray, np.ndarray],
    near: float,
) -> None:
    """Raise NoBackgroundError unless walls with inclined triangles are lines in projection.

    across : (V, 2) vertices, projected along the axis
    wall : (F,) number of the face of each triangle
    leans : (F,) whether it is inclined
    borders : triangles (E, 2) and ends (E, 2) of the edges at the top and bottom of walls
    """
    adjacent, ends = borders
    corners = across[surface.faces]
    flat = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    for number in np.unique(wall[leans]):
        own = wall == number
        vertices = np.unique(surface.faces[own])
        lines = across[ends[(wall[adjacent] == number).any(axis=1)]]
        off = to_lines(across[vertices], lines)[0].min(axis=1, initial=np.inf)
        chord = np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1)
        between = FLAT * known.area[own].sum() + SAG * (chord**2).sum()  # of two polylines
        if abs(flat[own].sum()) > between or off.max() > near + SAG * chord.max(initial=0):
            where = surface.vertices[vertices[np.argmax(off)]]
            what = f"a face is not parallel to an axis near {place(surface, where)}"
            raise NoBackgroundError(what)
