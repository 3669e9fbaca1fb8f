"""Holes and bosses across an axis, the chamfers and fillets round their ends, and their squares."""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.arrangement import sagitta
from polycube.hexmesh.background.curves import Sizes, whole
from polycube.types import TriMesh

ON_SIDE = 1e-6  # of the width of a hole: tolerance for its upright sides
INNER = 0.7  # of half a side: its part in which edges have a length of their own


class Collar(NamedTuple):
    """The chamfer, countersink or fillet round an end of a hole or boss, or its conical bottom."""

    faces: np.ndarray  # (N,) its triangles
    # (M,) vertices of its other border, in a plane across the hole; of a bottom, of its only one
    border: np.ndarray
    bulge: float  # largest distance of a round collar from the cone between its borders
    is_bottom: bool = False  # whether it is the conical bottom of a hole

    def rows(self, sizes: Sizes) -> int:
        """Number of hexes across it."""
        return max(1, whole(sizes.chords(self.bulge)))


class Hole(NamedTuple):
    """A ring of faces along a direction across the upright axis: round a hole, or round a boss."""

    faces: np.ndarray  # (N,) its triangles
    across: np.ndarray  # (3,) unit vector, perpendicular to its direction and to the upright axis
    middle: np.ndarray  # (2,) its centre: along `across`, and the height
    extent: np.ndarray  # (2,) half its width and half its height
    # least half width of its square beside windows and corners, relative to that of the hole
    wide: float
    sides: np.ndarray  # (2, 2) the sides of the square: along `across`, and their heights
    rims: list[np.ndarray]  # vertices of the loops around it
    # vertices of the other loops at its border, where other holes meet it
    windows: list[np.ndarray]
    corners: np.ndarray  # (N,) vertices of the rims at the ends of upright curves of other faces
    collars: tuple[Collar, ...] = ()

    @property
    def along(self) -> np.ndarray:
        """(3,) unit vector in its direction."""
        return np.cross(self.across, [0, 0, 1])

    def flat(self, places: np.ndarray) -> np.ndarray:
        """(N, 2) coordinates across its direction, and heights, of places (N, 3)."""
        return np.stack([places @ self.across, places[:, 2]], axis=1)

    def parts(self, sizes: Sizes) -> int:
        """Number of edges along each side of the square."""
        return sizes.in_quarter(float(self.extent.mean()))

    def on_sides(self, share: np.ndarray) -> np.ndarray:
        """(N, 2) points of the square after a number (N,) of its sides, from below right."""
        (left, right), (low, high) = self.sides
        corner = np.array([[right, low], [right, high], [left, high], [left, low], [right, low]])
        return np.stack([np.interp(share, np.arange(5), corner[:, d]) for d in (0, 1)], axis=1)

    def levels(
        self, surface: TriMesh, at: np.ndarray, before: np.ndarray, sizes: Sizes
    ) -> np.ndarray:
        """(N,) heights that divide its upright sides, and its collars above and below.

        at, before : (V, 3) vertices in the frame, now and before the hole was made square
        """
        low, high = self.sides[1]
        parts = [(low, high, self.parts(sizes))]
        for each in self.collars:
            outer, rows = at[each.border, 2], each.rows(sizes)
            parts += [(outer.min(), low, rows), (high, outer.max(), rows)]
        found = np.concatenate([np.linspace(a, b, rows + 1)[1:-1] for a, b, rows in parts])
        return np.concatenate([found, *self._at_ends(surface, at, before, sizes, found)])

    def _at_ends(
        self, surface: TriMesh, at: np.ndarray, before: np.ndarray, sizes: Sizes, levels: np.ndarray
    ) -> Iterator[np.ndarray]:
        """Heights that divide the arcs of its upright sides, as at the ends of a slot, further.

        levels : (N,) heights that divide these sides; borders of CAD faces divide them, too
        """
        used, on = np.unique(surface.faces[self.faces], return_inverse=True)
        face = np.unique(np.stack([on.ravel(), surface.region[self.faces].repeat(3)]), axis=1)
        is_border = np.bincount(face[0]) > 1
        off_side = abs(self.flat(at[used])[:, :1] - self.sides[0]) / np.ptp(self.sides[0])
        for is_on in (off_side < ON_SIDE).T:
            own = used[is_on][at[used[is_on], 2].argsort(kind="stable")]
            height, profile = at[own, 2], self.flat(before[own])
            marks = np.unique([*levels, *height[[0, -1]], *at[used[is_on & is_border], 2]])
            marks = marks[(marks >= height[0]) & (marks <= height[-1])]
            for low, high in pairwise(marks):
                heights = np.r_[low, height[(height > low) & (height < high)], high]
                places = np.stack([np.interp(heights, height, x) for x in profile.T], axis=1)
                yield np.linspace(low, high, whole(sizes.chords(sagitta(places))) + 1)[1:-1]

    def fine(self, at: np.ndarray, faces: np.ndarray, sizes: Sizes) -> np.ndarray:
        """(N, 3) places along its other sides and across collars, and lengths of edges there."""
        middle, half = self.sides[0].mean(), np.ptp(self.sides[0]) / 2
        strips = [(self.faces, 0.0, INNER * half, 2 * half / self.parts(sizes))]
        for each in self.collars:
            low, high = sorted((half, np.ptp(at[each.border] @ self.across) / 2))
            rows = each.rows(sizes)
            strips += [(each.faces, low, high, (high - low) / rows)] * (rows > 1)
        found = [np.zeros((0, 3))]
        for own, low, high, length in strips:
            places = at[np.unique(faces[own])]
            off = abs(places @ self.across - middle)
            places = places[(off >= low) & (off < high), :2]
            found.append(np.column_stack([places, np.full(len(places), length)]))
        return np.concatenate(found)


def flatten(surface: TriMesh, at: np.ndarray, hole: Hole, collar: Collar) -> float:
    """Set a collar into the plane of its border, in place; the coordinate along the hole there."""
    used = np.unique(surface.faces[collar.faces])
    x, y = ((hole.flat(at[used]) - hole.middle) / hole.extent).T
    share, radius = (np.arctan2(y, x) / (np.pi / 2) + 0.5) % 4, np.hypot(x, y)
    border, level = np.searchsorted(used, collar.border), (at[collar.border] @ hole.along).mean()
    radius[border] = radius[border].mean()
    for corner in range(4):  # its closest vertex is at the corner
        off = (share[border] - corner + 2) % 4 - 2
        share[border[abs(off).argmin()]] = corner
    middle = hole.sides.mean(axis=1)
    flat = middle + radius[:, None] * (hole.on_sides(share) - middle)
    at[used] = np.column_stack([flat[:, :1] * hole.across[:2], flat[:, 1]]) + level * hole.along
    return float(level)
