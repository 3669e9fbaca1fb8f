"""Sheets with bends, unfolded into a plane part, and folded back."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.plane import frame
from polycube.surface import closest
from polycube.surface.measures import (
    area_vectors,
    cad_vectors,
    curved_faces,
    diagonal,
    half_edges,
    place,
    twins,
    unit,
)
from polycube.types import TriMesh

from .path import PLANE
from .stack import NEAR

if TYPE_CHECKING:
    from collections.abc import Callable

SIDES = 4  # number of planes from which a side is followed
SMOOTH = np.cos(np.radians(20))  # least cosine between triangles of faces that continue each other
TANGENT = 1e-3  # sine of the largest angle between such faces
THIN = 0.3  # largest thickness, relative to the square root of the area of a side
TIGHT = 0.02  # least inner radius of a bend, relative to its outer one
ASIDE = 0.1  # of the thickness: largest distance of a vertex from the normal of its closest point

Borders = dict[int, dict[int, np.ndarray]]  # face -> next face -> common vertices (N,)


class Piece(NamedTuple):
    """A plane or a cylinder of one side of a sheet, and its place after unfolding.

    Parameters
    ----------
    origin : (3,) a point of its first border
    rows : (3, 3) unit vectors there: along the border, away from it, and outwards
    radius : of the cylinder; negative if its axis is outside of the sheet, 0 for a plane
    middle : radius in the middle of the sheet
    flat : (3,) the unfolded origin
    flat_rows : (3, 3) the unfolded rows
    """

    origin: np.ndarray
    rows: np.ndarray
    radius: float
    middle: float
    flat: np.ndarray
    flat_rows: np.ndarray

    def local(self, points: np.ndarray) -> np.ndarray:
        """Coordinates (N, 3) of points (N, 3): along the border, away from it, and outwards.

        The second one is measured in the middle of the sheet, round the axis of a cylinder.
        """
        along, ahead, out = ((points - self.origin) @ self.rows.T).T
        if self.radius:
            sign, out = np.sign(self.radius), out + self.radius
            turn = np.arctan2(ahead, sign * out)
            out = sign * np.hypot(ahead, out) - self.radius
            ahead = self.middle * np.where(turn < -np.pi / 2, turn + 2 * np.pi, turn)
        return np.stack([along, ahead, out], axis=1)

    def unfold(self, points: np.ndarray) -> np.ndarray:
        """The unfolded points (N, 3)."""
        return self.flat + self.local(points) @ self.flat_rows

    def fold(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) of the part for unfolded ones."""
        along, ahead, out = ((points - self.flat) @ self.flat_rows.T).T
        if self.radius:
            sign, turn = np.sign(self.radius), ahead / self.middle
            far = sign * (out + self.radius)
            ahead, out = far * np.sin(turn), sign * far * np.cos(turn) - self.radius
        return self.origin + np.stack([along, ahead, out], axis=1) @ self.rows

    def rows_at(self, point: np.ndarray) -> np.ndarray:
        """(3, 3) unit vectors at a point (3,), as `rows` at the border."""
        if not self.radius:
            return self.rows
        turn = self.local(point[None])[0, 1] / self.middle
        cosine, sine = np.cos(turn), np.sign(self.radius) * np.sin(turn)
        along, ahead, out = self.rows
        return np.stack([along, cosine * ahead - sine * out, cosine * out + sine * ahead])


class Unfolded(NamedTuple):
    """A sheet in a plane.

    Parameters
    ----------
    surface : its surface; one side is in the plane z = 0, and the other one below it
    side : (F,) whether a triangle is of the first side
    pieces : the faces of this side
    """

    surface: TriMesh
    side: np.ndarray
    pieces: dict[int, Piece]

    def fold(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) of the part for those of the plane part."""
        corners = self.surface.vertices[self.surface.faces[self.side]]
        _, face, _ = closest.closest(closest.tree(corners), points * [1, 1, 0])
        region, folded = self.surface.region[self.side][face], np.empty_like(points)
        for number in np.unique(region).tolist():
            own = region == number
            folded[own] = self.pieces[number].fold(points[own])
        return folded

    def lines(self, number: Callable[[float, float], float]) -> np.ndarray:
        """Lines (N, 2, 2) in the plane along the bends, for two edges between any two.

        number : of edges round a bend with a largest radius and an angle
        """
        found = [np.zeros((0, 2, 2))]
        for face, piece in self.pieces.items():
            if piece.radius:
                own = np.unique(self.surface.faces[self.side & (self.surface.region == face)])
                local = (self.surface.vertices[own] - piece.flat) @ piece.flat_rows.T
                (low, start, _), (high, end, _) = local.min(axis=0), local.max(axis=0)
                largest = max(abs(piece.radius), 2 * piece.middle - abs(piece.radius))
                parts = int(np.ceil(number(largest, (end - start) / piece.middle) / 2 - 0.05))
                at = np.linspace(start, end, parts + 1)[1:-1]
                ends = np.stack(np.broadcast_arrays([low, high], at[:, None]), axis=2)
                found.append(piece.flat[:2] + ends @ piece.flat_rows[:2, :2])
        return np.concatenate(found)


def unfolded(surface: TriMesh) -> Unfolded:
    """A sheet of constant thickness in a plane.

    One side is followed from its largest plane over all faces that continue it smoothly: planes,
    and cylinders (bends) along a straight border. Lengths are kept in the middle of the sheet.

    Raises
    ------
    NoBackgroundError
        If the part is no sheet, or if it has no bend; with the reason for the largest plane.
    """
    if not len(surface.region):
        raise NoBackgroundError("it has no CAD faces")
    sums, _ = cad_vectors(surface)
    size = np.linalg.norm(sums, axis=1)
    planes = np.flatnonzero(~curved_faces(surface, PLANE) & (size > 0))
    borders, reason = _borders(surface), None
    for start in planes[np.argsort(-size[planes], kind="stable")][:SIDES].tolist():
        try:
            return _unfolded(surface, borders, start, sums[start] / size[start])
        except NoBackgroundError as found:
            reason = reason or found
    raise reason or NoBackgroundError("it has no plane face")


def _borders(surface: TriMesh) -> Borders:
    """The smooth borders between CAD faces."""
    one, two = twins(surface.faces)
    sides = surface.region[np.stack([one // 3, two // 3], axis=1)]
    normal = unit(area_vectors(surface))
    turn = np.einsum("nd,nd->n", normal[one // 3], normal[two // 3])
    smooth = (sides[:, 0] != sides[:, 1]) & (turn > SMOOTH)
    ends, sides = half_edges(surface.faces)[one[smooth]], sides[smooth]
    pairs, number = np.unique(sides, axis=0, return_inverse=True)
    found: Borders = {}
    for k, (a, b) in enumerate(pairs.tolist()):
        vertices = np.unique(ends[number.ravel() == k])
        for here, there in ((a, b), (b, a)):
            known = found.setdefault(here, {}).get(there, vertices)
            found[here][there] = np.union1d(known, vertices)
    return found


def _unfolded(surface: TriMesh, borders: Borders, start: int, normal: np.ndarray) -> Unfolded:
    """The sheet, one side of which is followed from a plane with a normal."""
    x, near = surface.vertices, NEAR * diagonal(surface)
    side = np.isin(surface.region, list(_pieces(surface, borders, start, normal, 0.0)))
    tree = closest.tree(x[surface.faces[side]])
    at, face, _ = closest.closest(tree, x)
    off = np.linalg.norm(at - x, axis=1)
    thickness, area = off.max(), np.linalg.norm(area_vectors(surface)[side], axis=1).sum()
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
        raise NoBackgroundError(
            f"its thickness is not constant near {place(surface, x[np.argmax(wrong)])}"
        )
    return Unfolded(TriMesh(flat, surface.faces, region=surface.region), side, pieces)


def _pieces(
    surface: TriMesh, borders: Borders, start: int, normal: np.ndarray, thickness: float
) -> dict[int, Piece]:
    """The faces of the side of a sheet that contains a plane with a normal.

    Raises
    ------
    NoBackgroundError
        If the side is closed round a bend, or if a bend is too tight.
    """
    x, near = surface.vertices, NEAR * diagonal(surface)
    own = np.unique(surface.faces[surface.region == start])
    first = Piece(x[own[0]], frame(normal), 0.0, 0.0, np.zeros(3), np.eye(3))
    found, waiting = {start: first}, [start]
    while waiting:
        here = waiting.pop(0)
        for there, common in borders.get(here, {}).items():
            if there not in found:
                vertices = np.unique(surface.faces[surface.region == there])
                piece = _next(found[here], x[common], x[vertices], thickness, near)
                if piece is not None:
                    found[there] = piece
                    waiting.append(there)
            elif abs(found[here].unfold(x[common]) - found[there].unfold(x[common])).max() > (
                100 * near
            ):
                raise NoBackgroundError("its bends form a ring")
    return found


def _next(
    piece: Piece, border: np.ndarray, points: np.ndarray, thickness: float, near: float
) -> Piece | None:
    """The face of a sheet beyond the border (N, 3) of another one, if it continues it.

    points : (P, 3) of this face

    Raises
    ------
    NoBackgroundError
        If it is a bend without a radius on its inner side.
    """
    if abs(piece.local(points)[:, 2]).max() < near:  # the same plane or cylinder
        return piece
    origin = border.mean(axis=0)
    _, length, axes = np.linalg.svd(border - origin, full_matrices=False)
    if len(border) < 2 or length[1] > near:
        return None
    before = piece.rows_at(border[0])
    along, out = axes[0], before[2]
    if abs(along @ out) > TANGENT:
        return None
    ahead = np.cross(out, along)
    if (points.mean(axis=0) - origin) @ ahead < 0:
        along, ahead = -along, -ahead
    rows = np.stack([along, ahead, out])
    local = (points - origin) @ rows.T
    rise, far = local[:, 2], (local[:, 1:] ** 2).sum(axis=1)
    radius = middle = 0.0
    if abs(rise).max() > near:
        # on a cylinder with a tangent plane: ahead^2 + out^2 = -2 radius out
        radius = float(-(far @ rise) / (2 * rise @ rise))
        if abs(np.hypot(local[:, 1], rise + radius) - abs(radius)).max() > near:
            return None
        middle = float(abs(radius) - np.sign(radius) * thickness / 2)
        inner = min(abs(radius), abs(radius) - np.sign(radius) * thickness)
        if inner < TIGHT * (inner + thickness):
            raise NoBackgroundError(f"the inner radius of a bend is {max(inner, 0.0):.3g}")
    flat_rows = rows @ before.T @ piece.flat_rows
    return Piece(origin, rows, radius, middle, piece.unfold(origin[None])[0], flat_rows)
