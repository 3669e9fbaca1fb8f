"""Decides whether a hex mesh is valid, whether it has warnings, and which of two is better."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.settings import creases_of
from polycube.kinds import Acceptance
from polycube.registry import register, setting
from polycube.surface.measures import diagonal
from polycube.types import Goal, HexMesh, TriMesh, Verdict
from polycube.types.options import Options

from . import sentences

if TYPE_CHECKING:
    from polycube.hexmesh.inspection import Inspection

DOUBLED = 0.01  # scaled Jacobian that twice as many hexes must gain
SOME_LOST = 0.4  # shortfall of lost features, whatever their number
# more for their weighted share: at most the first, half of it for the second
ALL_LOST, HALF_LOST = 1.2, 0.1
MISSED = 0.02  # shortfall of a scaled Jacobian that is just below the wanted one


@register("acceptance", "standard")
@dataclass(frozen=True)
class Standard(Options, Goal, Acceptance):
    """Compare meshes by validity, then by how far they are from the goal, then by the worst hex.

    A mesh that is not valid is worst if it has inverted hexes, then if it crosses itself. The
    distance of a valid mesh from the goal is a sum: of the share of lost features of a CAD part,
    each weighted by its excess over the permitted distance (without CAD faces, of the distance of
    sharp edges); of the relative distance of the worst hex from the wanted scaled Jacobian (squared
    for a CAD part, whose features are more important), and a little for any such distance; of
    distances and other warnings; of wishes (`meshing.at`, `meshing.deviation`, `meshing.creases`)
    that are not met; and of doublings of the number of hexes. Of meshes that are equally far, the
    one with the larger merit of the fitting stages (`polycube.fitting.snapping`) is better, reduced
    for each doubling of the number of hexes.

    The limits are those of `polycube.types.Goal`.

    Parameters
    ----------
    certify : where the Jacobian must be positive: everywhere (Bernstein bounds), or at the corners
    at, deviation, creases : wishes, as in `meshing`
    """

    certify: Literal["everywhere", "corners"] = "everywhere"
    at: Sequence[object] = setting("meshing.at")
    deviation: sizing.Length | None = setting("meshing.deviation")
    creases: sizing.Length | Literal["auto"] | None = setting("meshing.creases")

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        """Judge a mesh; see `polycube.types.Verdict`."""
        from polycube.fitting.snapping import merit
        from polycube.hexmesh.inspection import inspect

        found = inspect(hexes, surface)
        is_positive = found.scaled_jacobian > 0
        open_ones = self._not_certified(hexes) if is_positive else np.zeros(0, np.int64)
        failures = tuple(sentences.failures(self, found, open_ones))
        # inverted hexes are worse than crossings, these than large distances, these than the rest
        is_off = found.largest > self.distance_limit or sentences.has_wrong_volume(self, found)
        is_bad = 4 * bool(len(found.crossings)) + 2 * is_off + bool(failures)
        is_bad += 8 * (not is_positive)
        warnings = () if failures else (*sentences.warnings(self, found), *self._unmet(found))
        shortfall = self._shortfall(found, is_bad, len(warnings))
        merits = merit(found) - DOUBLED * float(np.log2(len(hexes.hexes)))
        key = -float(is_bad), -sum(shortfall.values()), merits
        lost = self._lost(found) if len(surface.region) else 0
        return Verdict(failures, warnings, key, shortfall, lost, self)

    def _shortfall(self, found: Inspection, is_bad: int, n_warnings: int) -> dict[str, float]:
        """How far a mesh is from the goal, by criterion; met criteria are left out."""
        is_cad = len(found.surface.region) > 0
        wanted, power = (self.scaled_jacobian, 2) if is_cad else (self.smooth_jacobian, 1)
        below = 1 - found.scaled_jacobian / wanted
        without = len(found.faces_without_quads)
        is_poor = found.scaled_jacobian < self.poor_jacobian
        n_known = (self._lost(found) > without) + (without > 0) + is_poor
        parts = {
            "validity": 3.0 if is_bad >= 4 else 2.5 if is_bad >= 2 else 2.0 * is_bad,
            "features": self._lost_share(found),
            "distances": 0.5 * self._is_far(found),
            "scaled_jacobian": max(0.0, below) ** power + MISSED * (below > 0),
            "warnings": 0.25 * (n_warnings > n_known),
            "wishes": min(0.5, 0.25 * self._wishes(found) + 0.1 * self._off_creases(found)),
            "hexes": self.many * max(0.0, float(np.log2(len(found.mesh.hexes) / self.hexes))),
        }
        return {name: value for name, value in parts.items() if value > 0}

    def _lost_share(self, found: Inspection) -> float:
        """Shortfall for lost features, below 2; 0 within the margin."""
        if not len(found.surface.region):
            return 0.25 * min(1.0, max(0.0, found.creases / self.features - 1))
        lost = [each for each in sentences.lost(self, found) if each.size >= self.detail]
        excess = sum(min(1.0, each.excess(self) - 1) for each in lost)
        without = sum(width >= self.detail for width in found.faces_without_quads.values())
        number = max(1, len(found.features))
        if excess + without <= self.margin * number:
            return 0.0
        share = ((excess + len(lost)) / 2 + without) / number
        return SOME_LOST + ALL_LOST * share / (share + HALF_LOST)

    def _wishes(self, found: Inspection) -> float:
        """How many wishes of `meshing.at` are missed, and by how much `meshing.deviation` is."""
        from polycube.hexmesh.generation.requests_met import missing

        off = missing(found.mesh, found.surface, requests_of(self.at)) if self.at else [0]
        return float(np.abs(off).sum()) + self._times(found.deviation.p99, self.deviation, found)

    def _off_creases(self, found: Inspection) -> float:
        """How many doublings sharp edges are farther than `meshing.creases`."""
        return self._times(found.creases, creases_of(self.creases, found.surface), found)

    def _times(self, reached: float, wanted: float | str | None, found: Inspection) -> float:
        """Doublings by which a distance exceeds a length; 0 without one."""
        if wanted is None:
            return 0.0
        unit = diagonal(found.surface)
        return max(0.0, float(np.log2(max(reached * unit / sizing.length(wanted, unit), 1e-9))))

    def _unmet(self, found: Inspection) -> Iterator[str]:
        """A sentence for each wish that the mesh misses."""
        from polycube.hexmesh.generation.requests_met import unmet

        yield from unmet(found.mesh, found.surface, requests_of(self.at)) if self.at else ()
        if self.creases not in (None, "auto") and self._off_creases(found):
            reached = f"{found.creases:.2%} of the diagonal of the mesh's edges"
            limit = f"not within {self.creases}"
            yield f"meshing.creases: 95 % of the sharp edges are within {reached}, {limit}"

    def _not_certified(self, hexes: HexMesh) -> np.ndarray:
        """Hexes whose Jacobian is not certified to be positive, if `certify` requires it."""
        if self.certify == "corners":
            return np.zeros(0, np.int64)
        from polycube.hexmesh.certificate import certify

        return np.flatnonzero(~certify(hexes.vertices, hexes.hexes).positive)

    def _lost(self, found: Inspection) -> int:
        """Number of lost points, curves and faces of a CAD part; 0 or 1 for other surfaces."""
        if not len(found.surface.region):
            return int(found.creases > self.features)
        return len(found.faces_without_quads) + len(sentences.lost(self, found))

    def _is_far(self, found: Inspection) -> bool:
        """Whether distances or volume exceed their limits."""
        apart = found.deviation
        is_off = abs(found.volume_ratio - 1) > self.far_volume
        return is_off or apart.p99 > self.distance or apart.vertices > self.far_vertices
