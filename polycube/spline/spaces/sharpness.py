"""Sets of creases that a spline can keep, and comparison of the splines fitted with them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from polycube.spline.bezier import Jacobian, min_detj, scaled_detj
from polycube.spline.boundary import Deviation, deviation
from polycube.spline.spaces.extraction import NO_INDICES, volumetric_spline
from polycube.spline.spaces.sharp_features import (
    creases,
    folds,
    is_among,
    kinks,
    union,
    without_dead_ends,
)
from polycube.types import HexMesh, Spline, TriMesh

LEAST = 0.05  # scaled det J below which a hex is made straight
KEPT = 0.5  # share of the floor of scaled det J that matters more than the distance
FLOOR = 0.1  # smallest scaled det J that a crease may cause in an element
# costs, as equivalent distances in diagonals
HALVED_DETJ = 0.001  # of each halving of scaled det J below the floor
VOLUME = 0.2  # of a relative error of 1 of the volume
STRAIGHT = 0.01  # of straight hexes everywhere
SMOOTH_BORDER = 0.02  # of a border of supports and loads without any sharp edge
INVALID = 1e3  # smallest cost of a spline whose det J may be negative
GOOD = 0.001  # cost below which no other spline is tried
POOR = 0.006  # cost of the best spline above which straight hexes are tried
NO_EDGES = np.zeros((0, 2), np.int64)


class Sharp(NamedTuple):
    """Sharp edges and corners."""

    edges: np.ndarray  # (S, 2) on the boundary, with ascending ends
    corners: np.ndarray  # (P,) vertices of these edges
    straight: np.ndarray = NO_INDICES  # (T,) hexes that stay trilinear


class Creases:
    """The creases of a mesh and the borders of supports and loads.

    hexes : the mesh
    forced : (S, 2) edges that are always sharp
    angle : in radians; a crease that turns by more has a corner there
    fold : whether a crease that turns within a face has a corner there
    borders : (B, 2) edges around supports and loads
    found : (C, 2) creases; None: the edges at which the boundary turns by more than `angle`
    corners : (P,) possible corners of a crease that turns; None: all vertices
    """

    def __init__(
        self,
        hexes: HexMesh,
        forced: np.ndarray,
        angle: float,
        fold: bool,
        borders: np.ndarray = NO_EDGES,
        found: np.ndarray | None = None,
        corners: np.ndarray | None = None,
    ) -> None:
        self.hexes, self.forced, self.angle, self.fold = hexes, forced, angle, fold
        self.borders, self._corners = borders, corners
        self.found = union(creases(hexes, angle) if found is None else found, borders)

    def all_but(self, blunt: np.ndarray) -> Sharp:
        """All creases without loose ends, except those at `blunt` vertices."""
        selected = self.found[~np.isin(self.found, blunt).any(axis=1)]
        edges = union(self.forced, without_dead_ends(union(self.forced, selected)))
        return Sharp(edges, union(self.folds(edges), np.setdiff1d(self.kinks(edges), blunt)))

    def kinks(self, edges: np.ndarray) -> np.ndarray:
        """(P,) vertices where curves of edges turn, among the possible corners."""
        found = kinks(self.hexes, edges, self.angle)
        return found if self._corners is None else np.intersect1d(found, self._corners)

    def harmless(self) -> Sharp:
        """The largest set of creases and kinks with a sufficient det J of the unfitted spline."""
        plain = Sharp(self.forced, self.folds(self.forced))
        floor = np.minimum(scaled_detj(volumetric_spline(self.hexes, *plain)), FLOOR) - 1e-9
        blunt = np.zeros(0, np.int64)
        while True:
            sharp = self.all_but(blunt)
            bad = self.hexes.hexes[scaled_detj(volumetric_spline(self.hexes, *sharp)) < floor]
            if len(bad) == 0:
                return sharp
            if np.isin(bad, blunt).all():
                return plain
            blunt = union(blunt, bad.ravel())

    def straightened(self, sharp: Sharp) -> Sharp:
        """The same creases, with hexes of low det J in the unfitted spline made straight.

        They are made straight in sequence, because neighbours of straight hexes may become low. If
        all are straight, the spline is the mesh.
        """
        straight = np.zeros(0, np.int64)
        while True:
            scaled = scaled_detj(volumetric_spline(self.hexes, *sharp[:2], straight))
            low = np.setdiff1d(np.flatnonzero(scaled < LEAST), straight)
            if len(low) == 0:
                return Sharp(*sharp[:2], straight)
            straight = union(straight, low)

    def lost(self, sharp: Sharp) -> float:
        """Share of the borders that is not sharp."""
        selected = is_among(self.borders, sharp.edges)
        return 1 - selected.mean() if len(selected) else 0.0

    def folds(self, edges: np.ndarray) -> np.ndarray:
        """(P,) vertices where edges fold along a face, if these become corners."""
        return folds(self.hexes, edges) if self.fold else np.zeros(0, np.int64)


@dataclass(frozen=True)
class Trial:
    """A spline with some creases, and its cost in diagonals."""

    name: str
    spline: Spline
    sharp: Sharp
    jacobian: Jacobian
    apart: Deviation
    cost: float

    @classmethod
    def of(
        cls,
        name: str,
        spline: Spline,
        sharp: Sharp,
        surface: TriMesh,
        floor: float,
        lost: float = 0.0,
    ) -> Trial:
        """A trial with its cost, including straight hexes and the share of lost borders."""
        hexes = spline.element_hex.max() + 1
        jacobian, apart = min_detj(spline), deviation(spline, surface)
        total = cost(jacobian, apart, floor) + STRAIGHT * len(sharp.straight) / hexes
        total += POOR * (jacobian.min_scaled_detj < KEPT * floor)
        return cls(name, spline, sharp, jacobian, apart, total + SMOOTH_BORDER * lost)

    def summary(self) -> str:
        """The deciding quantities, for the log."""
        apart, jacobian = self.apart, self.jacobian
        farthest = max(apart.to_surface.p99, apart.to_spline.p99)
        number = len(self.sharp.straight)
        straight = f" and {number} straight hexes" if number else ""
        return (
            f"{len(self.sharp.edges)} sharp edges{straight} for {100 * farthest:.3f} %, volume "
            f"{100 * apart.volume:+.2f} % and scaled det J {jacobian.min_scaled_detj:.3g}"
            + " (not valid)"
            * (jacobian.lower_bound <= 0)
        )


def cost(jacobian: Jacobian, apart: Deviation, floor: float) -> float:
    """Cost of a spline in diagonals, from its det J and its deviation from the surface.

    It consists of the 99th percentiles of the distance in both directions, the error of the volume,
    and the shortfall of scaled det J below a floor. If det J is not certified positive, the cost is
    above that of all positive splines, and grows with the distance from positivity.
    """
    if jacobian.lower_bound <= 0:
        return INVALID + 1 - jacobian.min_scaled_detj
    shortfall = max(np.log2(floor / jacobian.min_scaled_detj), 0)
    far = max(apart.to_surface.p99, apart.to_spline.p99)
    return far + VOLUME * abs(apart.volume) + HALVED_DETJ * shortfall
