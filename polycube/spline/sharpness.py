"""Sets of creases that a spline may keep, and which of the splines fitted with them is better."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from polycube.spline.bezier import min_detj, scaled_detj
from polycube.spline.deviation import deviation
from polycube.spline.extraction import volumetric_spline
from polycube.spline.features import creases, folds, kinks, union, without_dead_ends
from polycube.types import HexMesh, Spline, TriMesh

FLOOR = 0.1  # scaled det J below which a crease may not push an element
WORTH = 0.001  # distance, in diagonals, that half the scaled det J is worth below a floor
INVALID = 1e3  # cost of a spline whose det J may be negative
GOOD = 0.001  # cost of a spline that needs no rival


class Sharp(NamedTuple):
    """What is kept sharp."""

    edges: np.ndarray  # (S, 2) of the boundary, ends ascending
    corners: np.ndarray  # (P,) vertices on them


class Creases:
    """The creases of a mesh by angle, beside edges (S, 2) that are sharp anyhow."""

    def __init__(self, hexes: HexMesh, forced: np.ndarray, angle: float, fold: bool) -> None:
        self.hexes, self.forced, self.angle, self.fold = hexes, forced, angle, fold
        self.found = creases(hexes, angle)

    def all_but(self, blunt: np.ndarray) -> Sharp:
        """All creases without ends in the smooth surface, but those that meet `blunt` vertices."""
        kept = self.found[~np.isin(self.found, blunt).any(axis=1)]
        edges = union(self.forced, without_dead_ends(union(self.forced, kept)))
        tips = np.setdiff1d(kinks(self.hexes, edges, self.angle), blunt)
        return Sharp(edges, union(self.folds(edges), tips))

    def harmless(self) -> Sharp:
        """As many creases and kinks as leave det J of the spline alone that is not fitted."""
        plain = Sharp(self.forced, self.folds(self.forced))
        floor = np.minimum(scaled_detj(volumetric_spline(self.hexes, *plain)), FLOOR) - 1e-9
        blunt = np.zeros(0, np.int64)
        while True:
            sharp = self.all_but(blunt)
            low = scaled_detj(volumetric_spline(self.hexes, *sharp)) < floor
            spoiled = self.hexes.hexes[low]
            if len(spoiled) == 0:
                return sharp
            if np.isin(spoiled, blunt).all():
                return plain
            blunt = union(blunt, spoiled.ravel())

    def folds(self, edges: np.ndarray) -> np.ndarray:
        """(P,) vertices where edges fold along a face, where these are to be corners."""
        return folds(self.hexes, edges) if self.fold else np.zeros(0, np.int64)


def cost(spline: Spline, surface: TriMesh, floor: float) -> float:
    """Distance of the farthest percent either way, and what scaled det J lacks below a floor.

    In diagonals; where det J is not certified to be positive, more than any that is, by how far
    it is from that.
    """
    jacobian, apart = min_detj(spline), deviation(spline, surface)
    if jacobian.lower_bound <= 0:
        return INVALID - jacobian.min_scaled_detj
    lack = max(np.log2(floor / jacobian.min_scaled_detj), 0)
    return max(apart.to_surface.p99, apart.to_spline.p99) + WORTH * lack
