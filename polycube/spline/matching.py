"""Goals for points of the boundary of a spline, matched in both directions and at creases.

Points of the spline are matched with the closest compatible points of the surface. Points of the
surface and of its creases are matched with the closest points of the boundary, so that all of the
surface is covered. Sides on a CAD face are matched only with this face, and the edges between two
CAD faces with the curve between them.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, vstack

from polycube.spline import boundary
from polycube.spline.bernstein import gauss
from polycube.surface import closest
from polycube.surface.curved import smooth_curve
from polycube.surface.fit_target import ALPHA, FREE, Target
from polycube.surface.measures import twins
from polycube.types import Spline

OWN = 4  # points on a face in each direction
PIECES = 4  # divisions of a face in each direction, for closest points on the boundary
SAMPLES = 6000  # points of the surface
STEP = 0.004  # spacing of points on creases, in diagonals
COVER = 2.0  # weight of the points of the surface, relative to those of the spline
# weight of points on creases per side length of a face; larger values bulge rounded edges
CREASE = 0.3
CURVE = 16.0  # weight of an edge between CAD faces, relative to a face of mean area
REACH = 0.7  # distance within which a crease is matched, in side lengths of a face
LINE = np.arange(5) / 4  # points on an edge; its ends belong to corners, where curves meet
# u and v on the edge from each corner to the next
AROUND = np.array([[LINE, 0 * LINE], [1 + 0 * LINE, LINE], [1 - LINE, 1 + 0 * LINE],
                   [0 * LINE, 1 - LINE]])  # fmt: skip


class Matches(NamedTuple):
    """Points `rows @ control` of the boundary, and matched points of the surface."""

    rows: csr_matrix  # (M, C)
    goal: np.ndarray  # (M, 3)
    normal: np.ndarray  # (M, 3) unit vectors along which a gap has its full weight
    # (M,) weight of the squared gap; the points of a face of mean area have the sum 1
    weight: np.ndarray


class Matcher:
    """Matches a spline with moving control points to a target at unit scale.

    cad_face : (S,) number of the CAD face of each side; 0 for any
    """

    def __init__(self, spline: Spline, target: Target, cad_face: np.ndarray) -> None:
        self.spline, self.target, self._cad_face = spline, target, cad_face
        self._curves = CurveMatcher(spline, target, cad_face)
        at = boundary.sampling(spline, *boundary.grid(gauss(OWN)[0]))
        skin, _, _ = boundary.sampling(spline, *boundary.grid(np.arange(PIECES + 1) / PIECES))
        self.rows, self._du, self._dv = (part @ spline.extraction for part in at)
        self._skin = skin @ spline.extraction
        self._own_face: np.ndarray | None = None
        self._tree: closest.Tree | None = None
        self._points, self._normals, self._on = target.samples(SAMPLES)
        if len(target.surface.region):
            feet = target.closest(self._points, self._normals, ALPHA)
            self._points, self._normals = target.smooth(*feet)
        found = set(cad_face.tolist())
        loose = (c for c in target.followed.creases if not found.issuperset(c.faces))
        on = [c.at(np.arange(STEP / 2, c.length, STEP))[0] for c in loose]
        self._creases = np.concatenate([np.zeros((0, 3)), *on])

    def __call__(self, control: np.ndarray) -> Matches:
        """Matches of control points (C, 3) at the unit scale of the target."""
        du, dv = self._du @ control, self._dv @ control
        area = np.linalg.norm(np.cross(du, dv).reshape(-1, OWN**2, 3).mean(axis=1), axis=1)
        share = area / area.mean() ** 2
        parts = [
            self._from_spline(control, boundary.normals(du, dv), share),
            *self._from_surface(control, area, share),
            self._along(control, share),
        ]
        rows, *rest = zip(*parts, strict=True)
        return Matches(vstack(rows).tocsr(), *(np.concatenate(part) for part in rest))

    def _from_spline(self, control: np.ndarray, facing: np.ndarray, share: np.ndarray) -> Matches:
        at = self.rows @ control
        chart = np.repeat(self._cad_face, OWN**2)
        foot, self._own_face = self.target.closest(at, facing, ALPHA, self._own_face, FREE, chart)
        weight = np.repeat(share, OWN**2) / OWN**2
        return Matches(self.rows, *self.target.smooth(foot, self._own_face), weight)

    def _from_surface(
        self, control: np.ndarray, area: np.ndarray, share: np.ndarray
    ) -> list[Matches]:
        """Matches of the points of the surface with compatible normals, and of close creases."""
        pieces = boundary.triangles(self._skin @ control, PIECES)
        facing = boundary.normals(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])
        if self._tree is None:
            self._tree = closest.tree(pieces, facing)
        else:  # with the first subdivision
            self._tree = closest.moved(self._tree, pieces, facing)
        face, piece, rows = self._place(self._tree, self._points, self._normals)
        faces_it = np.einsum("nd,nd->n", self._normals, facing[piece]) > 0.3
        faces_it &= (self._cad_face[face] == 0) | (self._cad_face[face] == self._on)
        count = np.bincount(face, minlength=len(area))[face]
        gap = self._points - rows @ control
        along = gap - (gap * self._normals).sum(axis=1, keepdims=True) * self._normals
        goal = self._points - along * (self._cad_face[face, None] > 0)
        cover = Matches(rows, goal, self._normals, COVER * share[face] / count * faces_it)
        if len(self._creases) == 0:
            return [cover]
        face, _, rows = self._place(self._tree, self._creases)
        gap = self._creases - rows @ control
        length, side = np.linalg.norm(gap, axis=1), np.sqrt(area[face])
        weight = CREASE * STEP / side * share[face] * (length < REACH * side)
        return [cover, Matches(rows, self._creases, gap / (length[:, None] + 1e-12), weight)]

    def _along(self, control: np.ndarray, share: np.ndarray) -> Matches:
        """Matches of the edges between CAD faces."""
        rows, goal = self._curves.rows, self._curves(control)
        gap = goal - rows @ control
        length = np.linalg.norm(gap, axis=1, keepdims=True)
        weight = CURVE / len(LINE) * share[self._curves.side]
        return Matches(rows, goal, gap / (length + 1e-12), weight)

    def _place(
        self, tree: closest.Tree, points: np.ndarray, facing: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, csr_matrix]:
        """Face and part (n,) of the closest points on the boundary, and their rows (n, C)."""
        alpha = 0.0 if facing is None else ALPHA
        _, piece, share = closest.closest(tree, points, facing, alpha, None, FREE)
        face, local = np.divmod(piece, 2 * PIECES**2)
        u, v = np.einsum("nk,nkd->dn", share, boundary.corners(PIECES)[local])
        rows, _, _ = boundary.sampling(self.spline, u, v, face)
        return face, piece, rows @ self.spline.extraction


class CurveMatcher:
    """Points on the edges between sides of two CAD faces, matched with the curves between these.

    spline : spline at unit scale
    target : the surface
    cad_face : (S,) number of the CAD face of each side; 0 for any

    rows : (M, C) matrix from the control points to the points
    side : (M,) a side of each point
    """

    def __init__(self, spline: Spline, target: Target, cad_face: np.ndarray) -> None:
        curves: dict[tuple[int, int], list[np.ndarray]] = {}
        for crease in target.followed.creases:
            points = smooth_curve(crease)
            curves.setdefault(crease.faces, []).append(np.stack([points[:-1], points[1:]], axis=1))
        first, second = twins(boundary.corner_nodes(spline))
        adjacent = np.sort(cad_face[np.stack([first, second], axis=1) // 4], axis=1)
        between = (adjacent[:, 0] > 0) & (adjacent[:, 0] < adjacent[:, 1])
        self._trees, parts = [], []
        for pair in np.unique(adjacent[between], axis=0).tolist():
            if tuple(pair) in curves:
                self._trees.append(closest.tree(np.concatenate(curves[tuple(pair)])[:, [0, 1, 1]]))
                parts.append(first[(adjacent == pair).all(axis=1)])
        edges = np.concatenate([np.zeros(0, np.int64), *parts])
        self._counts = [len(part) * len(LINE) for part in parts]
        self.side = np.repeat(edges // 4, len(LINE))
        u, v = AROUND[edges % 4].transpose(1, 0, 2).reshape(2, -1)
        self.rows: csr_matrix = boundary.sampling(spline, u, v, self.side)[0] @ spline.extraction

    def __call__(self, control: np.ndarray) -> np.ndarray:
        """(M, 3) closest points on the curves for control points (C, 3)."""
        places = np.split(self.rows @ control, np.cumsum(self._counts)[:-1])
        goals = [closest.closest(t, p)[0] for t, p in zip(self._trees, places, strict=False)]
        return np.concatenate([np.zeros((0, 3)), *goals])
