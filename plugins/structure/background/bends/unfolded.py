"""Sheets with bends, unfolded into a plane part, and folded back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.curves import Sizes, whole
from polycube.hexmesh.background.motion import edges_in_bend
from polycube.hexmesh.background.sheet_piece import Piece, next_piece
from polycube.surface import closest, measures
from polycube.types import TriMesh

from ..stack import NEAR
from .path import PLANE

SIDES = 4  # number of planes from which a side is followed
SMOOTH = np.cos(np.radians(20))  # least cosine between triangles of faces that continue each other
THIN = 0.3  # largest thickness, relative to the square root of the area of a side
ASIDE = 0.1  # of the thickness: largest distance of a vertex from the normal of its closest point

Borders = dict[int, dict[int, np.ndarray]]  # face -> next face -> common vertices (N,)


class Unfolded(NamedTuple):
    """A sheet in a plane."""

    surface: TriMesh  # its surface; one side is in the plane z = 0, and the other one below it
    side: np.ndarray  # (F,) whether a triangle is of the first side
    pieces: dict[int, Piece]  # the faces of this side

    def fold(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) of the part for those of the plane part."""
        corners = self.surface.vertices[self.surface.faces[self.side]]
        _, face, _ = closest.closest(closest.tree(corners), points * [1, 1, 0])
        region, folded = self.surface.region[self.side][face], np.empty_like(points)
        for number in np.unique(region).tolist():
            own = region == number
            folded[own] = self.pieces[number].fold(points[own])
        return folded

    def lines(self, sizes: Sizes) -> np.ndarray:
        """Lines (N, 2, 2) in the plane along the bends, for two edges between any two."""
        found = [np.zeros((0, 2, 2))]
        for face, piece in self.pieces.items():
            if piece.radius:
                own = np.unique(self.surface.faces[self.side & (self.surface.region == face)])
                local = (self.surface.vertices[own] - piece.flat) @ piece.flat_rows.T
                (low, start, _), (high, end, _) = local.min(axis=0), local.max(axis=0)
                largest = max(abs(piece.radius), 2 * piece.middle - abs(piece.radius))
                parts = whole(edges_in_bend(sizes, largest, (end - start) / piece.middle) / 2)
                at = np.linspace(start, end, parts + 1)[1:-1]
                ends = np.stack(np.broadcast_arrays([low, high], at[:, None]), axis=2)
                found.append(piece.flat[:2] + ends @ piece.flat_rows[:2, :2])
        return np.concatenate(found)


def unfolded(surface: TriMesh) -> Unfolded:
    """A sheet of constant thickness in a plane.

    One side is followed from its largest plane over all faces that continue it smoothly: planes,
    and cylinders (bends) along a straight border. Lengths are kept in the middle of the sheet.

    Raises NoBackgroundError if the part is no sheet, or if it has no bend; with the reason for the
    largest plane.
    """
    if not len(surface.region):
        raise NoBackgroundError("it has no CAD faces")
    sums, _ = measures.cad_vectors(surface)
    size = np.linalg.norm(sums, axis=1)
    planes = np.flatnonzero(~measures.curved_faces(surface, PLANE) & (size > 0))
    borders, reason = _borders(surface), None
    for start in planes[np.argsort(-size[planes], kind="stable")][:SIDES].tolist():
        try:
            return _unfolded(surface, borders, start, sums[start] / size[start])
        except NoBackgroundError as found:
            reason = reason or found
    raise reason or NoBackgroundError("it has no plane face")


def _borders(surface: TriMesh) -> Borders:
    """The smooth borders between CAD faces."""
    one, two = measures.between_faces(surface)
    normal = measures.face_normals(surface)
    smooth = np.einsum("nd,nd->n", normal[one // 3], normal[two // 3]) > SMOOTH
    sides = np.sort(surface.region[np.stack([one // 3, two // 3], axis=1)[smooth]], axis=1)
    ends = measures.half_edges(surface.faces)[one[smooth]]
    pairs, number = np.unique(sides, axis=0, return_inverse=True)
    found: Borders = {}
    for k, (a, b) in enumerate(pairs.tolist()):
        vertices = np.unique(ends[number.ravel() == k])
        found.setdefault(a, {})[b] = found.setdefault(b, {})[a] = vertices
    return found


def _unfolded(surface: TriMesh, borders: Borders, start: int, normal: np.ndarray) -> Unfolded:
    """The sheet, one side of which is followed from a plane with a normal."""
    x, near = surface.vertices, NEAR * measures.diagonal(surface)
    side = np.isin(surface.region, list(_pieces(surface, borders, start, normal, 0.0)))
    at, face, _ = closest.closest(closest.tree(x[surface.faces[side]]), x)
    off = np.linalg.norm(at - x, axis=1)
    thickness, area = off.max(), measures.face_areas(surface)[side].sum()
    if not near < thickness < THIN * np.sqrt(area):
        raise NoBackgroundError("it is not a thin sheet")
    pieces = _pieces(surface, borders, start, normal, thickness)
    if not any(piece.radius for piece in pieces.values()):
        raise NoBackgroundError("it has no bend")
    region, flat = surface.region[side][face], np.empty_like(x)
    for number, piece in pieces.items():
        own = region == number
        flat[own] = piece.unfold(x[own])
    for number, piece in pieces.items():  # vertices beside a bend may be nearer to its neighbours
        if piece.radius:
            around = np.flatnonzero(np.isin(region, [number, *borders[number]]))
            used = np.unique(surface.faces[side & (surface.region == number)])
            end = piece.local(x[used])[:, 1].max()
            local = piece.local(x[around])
            inside = (local[:, 1] > 0) & (local[:, 1] < end) & (abs(local[:, 2]) < thickness + near)
            flat[around[inside]] = piece.unfold(x[around[inside]])
    depth = -flat[:, 2]
    wrong = (depth < -near) | (depth > thickness + near) | (abs(off - depth) > ASIDE * thickness)
    if wrong.any():
        what = f"its thickness is not constant near {measures.place(surface, x[np.argmax(wrong)])}"
        raise NoBackgroundError(what)
    return Unfolded(TriMesh(flat, surface.faces, region=surface.region), side, pieces)


def _pieces(
    surface: TriMesh, borders: Borders, start: int, normal: np.ndarray, thickness: float
) -> dict[int, Piece]:
    """The faces of the side of a sheet that contains a plane with a normal.

    Raises NoBackgroundError if the side is closed round a bend, or if a bend is too tight.
    """
    x, near = surface.vertices, NEAR * measures.diagonal(surface)
    own = np.unique(surface.faces[surface.region == start])
    first = Piece(x[own[0]], measures.frame(normal), 0.0, 0.0, np.zeros(3), np.eye(3))
    found, waiting = {start: first}, [start]
    while waiting:
        here = waiting.pop(0)
        for there, common in borders.get(here, {}).items():
            if there not in found:
                vertices = np.unique(surface.faces[surface.region == there])
                piece = next_piece(found[here], x[common], x[vertices], thickness, near)
                if piece is not None:
                    found[there] = piece
                    waiting.append(there)
            elif abs(found[here].unfold(x[common]) - found[there].unfold(x[common])).max() > (
                100 * near
            ):
                raise NoBackgroundError("its bends form a ring")
    return found
