"""The planes and bends of one side of a sheet, and their places after unfolding."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError

TANGENT = 1e-3  # sine of the largest angle between a border of a bend and the plane beside it
TIGHT = 0.02  # least inner radius of a bend, relative to its outer one


class Piece(NamedTuple):
    """A plane or a cylinder of one side of a sheet, and its place after unfolding."""

    origin: np.ndarray  # (3,) a point of its first border
    rows: np.ndarray  # (3, 3) unit vectors there: along the border, away from it, and outwards
    radius: float  # of the cylinder; negative if its axis is outside of the sheet, 0 for a plane
    middle: float  # radius in the middle of the sheet
    flat: np.ndarray  # (3,) the unfolded origin
    flat_rows: np.ndarray  # (3, 3) the unfolded rows

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


def next_piece(
    piece: Piece, border: np.ndarray, points: np.ndarray, thickness: float, near: float
) -> Piece | None:
    """The face of a sheet beyond the border (N, 3) of another one, if it continues it.

    points : (P, 3) of this face

    Raises NoBackgroundError if it is a bend without a radius on its inner side.
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
