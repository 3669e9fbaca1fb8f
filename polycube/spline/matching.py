"""Where points of a spline's boundary should be: matched from both sides, creases too.

Own points go to the closest point of the surface whose normal suits.  Points of the surface and of
its creases pull the point of the boundary that is closest to them, so that nothing is missed.
Sides that are on a face of a CAD model are matched with this face alone, and the edges between two
of them with the curve there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, vstack

from polycube.spline.bernstein import gauss
from polycube.spline.boundary import corners, grid, normals, sampling, triangles
from polycube.spline.curve_matching import LINE, CurveMatcher
from polycube.surface import closest
from polycube.surface.fit_target import Target
from polycube.types import Spline

OWN = 4  # points on a face, each way
PIECES = 4  # cuts of a face, each way, where the closest point of the boundary is sought
SAMPLES = 6000  # of the surface
STEP = 0.004  # between points on creases, in diagonals
ALPHA = 0.04  # length that a whole turn of the normal is worth, in diagonals
FREE = 1.0  # square difference of normals (60 degrees) that costs nothing
COVER = 2.0  # weight of the surface's points beside the own
CREASE = 0.3  # weight of a crease's points, per length of a face's side; more swells round edges
CURVE = 16.0  # weight of an edge between CAD faces, beside a face of mean area
REACH = 0.7  # sides of a face from which a crease pulls


class Matches(NamedTuple):
    """Points `rows @ control` of the boundary, and the points of the surface for them."""

    rows: csr_matrix  # (M, C)
    goal: np.ndarray  # (M, 3)
    normal: np.ndarray  # (M, 3) unit vectors along which a gap counts most
    weight: np.ndarray  # (M,) of the squared gap; own points of a face of mean area have 1 in all


class Matcher:
    """Matches a spline, whose control points move, to a target at unit scale.

    cad_face : (S,) number of the CAD face that each side is on; 0 for any
    """

    def __init__(self, spline: Spline, target: Target, cad_face: np.ndarray) -> None:
        self.spline, self.target, self._cad_face = spline, target, cad_face
        self._curves = CurveMatcher(spline, target, cad_face)
        at = sampling(spline, *grid(gauss(OWN)[0]))
        skin, _, _ = sampling(spline, *grid(np.arange(PIECES + 1) / PIECES))
        self.rows, self._du, self._dv = (part @ spline.extraction for part in at)
        self._skin = skin @ spline.extraction
        self._own_face: np.ndarray | None = None
        self._trees: closest.Forest | None = None
        self._points, self._normals, self._on = target.samples(SAMPLES)
        found = set(cad_face.tolist())
        loose = (c for c in target.followed.creases if not found.issuperset(c.faces))
        on = [c.at(np.arange(STEP / 2, c.length, STEP))[0] for c in loose]
        self._creases = np.concatenate([np.zeros((0, 3)), *on])

    def __call__(self, control: np.ndarray) -> Matches:
        """Matches of control points (C, 3) at the target's unit scale."""
        du, dv = self._du @ control, self._dv @ control
        area = np.linalg.norm(np.cross(du, dv).reshape(-1, OWN**2, 3).mean(axis=1), axis=1)
        share = area / area.mean() ** 2
        parts = [
            self._own(control, normals(du, dv), share),
            *self._theirs(control, area, share),
            self._along(control, share),
        ]
        rows, *rest = zip(*parts, strict=True)
        return Matches(vstack(rows).tocsr(), *(np.concatenate(part) for part in rest))

    def _own(self, control: np.ndarray, facing: np.ndarray, share: np.ndarray) -> Matches:
        at = self.rows @ control
        chart = np.repeat(self._cad_face, OWN**2)
        foot, self._own_face = self.target.closest(at, facing, ALPHA, self._own_face, FREE, chart)
        weight = np.repeat(share, OWN**2) / OWN**2
        return Matches(self.rows, foot, self.target.normals[self._own_face], weight)

    def _theirs(self, control: np.ndarray, area: np.ndarray, share: np.ndarray) -> list[Matches]:
        """Of the points of the surface that face the spline, and of the creases within reach."""
        pieces = triangles(self._skin @ control, PIECES)
        facing = normals(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])
        tree = self._moved(pieces, facing).tree
        face, piece, rows = self._place(tree, self._points, self._normals)
        faces_it = np.einsum("nd,nd->n", self._normals, facing[piece]) > 0.3
        faces_it &= (self._cad_face[face] == 0) | (self._cad_face[face] == self._on)
        count = np.bincount(face, minlength=len(area))[face]
        gap = self._points - rows @ control
        along = gap - (gap * self._normals).sum(axis=1, keepdims=True) * self._normals
        goal = self._points - along * (self._cad_face[face, None] > 0)
        cover = Matches(rows, goal, self._normals, COVER * share[face] / count * faces_it)
        if len(self._creases) == 0:
            return [cover]
        face, _, rows = self._place(tree, self._creases)
        gap = self._creases - rows @ control
        length, side = np.linalg.norm(gap, axis=1), np.sqrt(area[face])
        weight = CREASE * STEP / side * share[face] * (length < REACH * side)
        return [cover, Matches(rows, self._creases, gap / (length[:, None] + 1e-12), weight)]

    def _moved(self, pieces: np.ndarray, facing: np.ndarray) -> closest.Forest:
        """Trees of the pieces of the boundary, split as they were the first time."""
        if self._trees is None:
            self._trees = closest.forest(pieces, facing, np.zeros(len(pieces), np.int64))
        else:
            self._trees = closest.moved(self._trees, pieces, facing)
        return self._trees

    def _along(self, control: np.ndarray, share: np.ndarray) -> Matches:
        """Of the edges between CAD faces."""
        rows, goal = self._curves.rows, self._curves(control)
        gap = goal - rows @ control
        length = np.linalg.norm(gap, axis=1, keepdims=True)
        weight = CURVE / len(LINE) * share[self._curves.side]
        return Matches(rows, goal, gap / (length + 1e-12), weight)

    def _place(
        self, tree: closest.Tree, points: np.ndarray, facing: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, csr_matrix]:
        """Face and piece (n,) of the closest points on the boundary, and their rows (n, C)."""
        alpha = 0.0 if facing is None else ALPHA
        _, piece, share = closest.closest(tree, points, facing, alpha, None, FREE)
        face, local = np.divmod(piece, 2 * PIECES**2)
        u, v = np.einsum("nk,nkd->dn", share, corners(PIECES)[local])
        rows, _, _ = sampling(self.spline, u, v, face)
        return face, piece, rows @ self.spline.extraction
