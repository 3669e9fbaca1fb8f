"""Decides whether a hex mesh is valid, whether it has warnings, and which of two is better."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.settings import MeshingSettings, creases_of
from polycube.kinds import Acceptance
from polycube.registry import register, setting
from polycube.types import Goal, HexMesh, TriMesh, Verdict

if TYPE_CHECKING:
    from polycube.hexmesh.feature_distances import Feature
    from polycube.hexmesh.inspection import Inspection

CERTIFY = ("everywhere", "corners")
DOUBLED = 0.01  # scaled Jacobian that twice as many hexes must gain
SOME_LOST = 0.4  # shortfall of lost features, whatever their number
# more for their weighted share: at most the first, half of it for the second
ALL_LOST, HALF_LOST = 1.2, 0.1
MISSED = 0.02  # shortfall of a scaled Jacobian that is just below the wanted one
FORCED = 0.9  # share of the sine of an acute angle of the part that a hex there reaches


@register("acceptance", "standard")
@dataclass(frozen=True)
class Standard(Goal, Acceptance):
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

    certify: str = CERTIFY[0]
    at: Sequence[object] = setting("meshing.at", MeshingSettings.at)
    deviation: float | str | None = setting("meshing.deviation", MeshingSettings.deviation)
    creases: float | str | None = setting("meshing.creases", MeshingSettings.creases)

    def __post_init__(self) -> None:
        if self.certify not in CERTIFY:
            raise ValueError(f"certify must be {' or '.join(CERTIFY)}; got {self.certify!r}")
        for name in ("creases", "deviation"):
            if getattr(self, name) not in (None, "auto"):
                sizing.check_length(name, getattr(self, name))
        if not 0 <= self.least_jacobian <= 1:
            raise ValueError(f"least_jacobian must be from 0 to 1; got {self.least_jacobian}")

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        """Judge a mesh; see `polycube.types.Verdict`."""
        from polycube.fitting.snapping import merit
        from polycube.hexmesh.inspection import inspect

        found = inspect(hexes, surface)
        is_positive = found.scaled_jacobian > 0
        open_ones = self._not_certified(hexes) if is_positive else np.zeros(0, np.int64)
        failures = tuple(self._failures(found, open_ones))
        # inverted hexes are worse than crossings, these than large distances, these than the rest
        is_off = found.largest > self.distance_limit or self._volume_error(found)
        is_bad = 4 * bool(len(found.crossings)) + 2 * is_off + bool(failures)
        is_bad += 8 * (not is_positive)
        warnings = () if failures else (*self._warnings(found), *self._unmet(found))
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
        n_known = bool(self._lost(found)) + (found.scaled_jacobian < self.poor_jacobian)
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

    def _volume_error(self, found: Inspection) -> bool:
        """Whether the volume is too different from that of the part."""
        return abs(found.volume_ratio - 1) > self.volume_limit

    def _lost_share(self, found: Inspection) -> float:
        """Shortfall for lost features, below 2; 0 within the margin."""
        if not len(found.surface.region):
            return 0.25 * min(1.0, max(0.0, found.creases / self.features - 1))
        excess = sum(min(1.0, each.excess(self) - 1) for each in self._off(found))
        number, without = max(1, len(found.features)), len(found.lost_faces)
        if excess + without <= self.margin * number:
            return 0.0
        share = ((excess + len(self._off(found))) / 2 + without) / number
        return SOME_LOST + ALL_LOST * share / (share + HALF_LOST)

    def _wishes(self, found: Inspection) -> float:
        """How many wishes of `meshing.at` are missed, and by how much `meshing.deviation` is."""
        from polycube.hexmesh.generation.requests_met import missing

        off = missing(found.mesh, found.surface, requests_of(self.at)) if self.at else [0]
        return float(np.abs(off).sum()) + self._times(found.deviation.p99, self.deviation, found)

    def _off_creases(self, found: Inspection) -> float:
        """How many doublings sharp edges are farther than `meshing.creases`."""
        wanted = creases_of(self.creases, found.surface)
        return self._times(found.creases, wanted, found)

    def _times(self, reached: float, wanted: float | str | None, found: Inspection) -> float:
        """Doublings by which a distance exceeds a length; 0 without one."""
        from polycube.surface.measures import diagonal

        if wanted is None:
            return 0.0
        unit = diagonal(found.surface)
        return max(0.0, float(np.log2(max(reached * unit / sizing.length(wanted, unit), 1e-9))))

    def _unmet(self, found: Inspection) -> Iterator[str]:
        """A sentence for each wish that the mesh misses."""
        from polycube.hexmesh.generation.requests_met import unmet

        yield from unmet(found.mesh, found.surface, requests_of(self.at)) if self.at else ()
        if self.creases not in (None, "auto") and self._off_creases(found):
            yield (
                f"meshing.creases: 95 % of the sharp edges are within {found.creases:.2%} of the "
                f"diagonal of the mesh's edges, not within {self.creases}"
            )

    def _not_certified(self, hexes: HexMesh) -> np.ndarray:
        """Hexes whose Jacobian is not certified to be positive, if `certify` requires it."""
        if self.certify == "corners":
            return np.zeros(0, np.int64)
        from polycube.hexmesh.certificate import certify

        return np.flatnonzero(~certify(hexes.vertices, hexes.hexes).positive)

    def _least(self, surface: TriMesh) -> float:
        """Smallest scaled Jacobian of a valid mesh, less where an angle of the part forces it."""
        from polycube.surface.curves.acute import acute

        forced = (FORCED * float(np.sin(each.angle)) for each in acute(surface))
        return min([self.least_jacobian, *forced])

    def _failures(self, found: Inspection, open_ones: np.ndarray) -> Iterator[str]:
        """Reasons why the mesh is not valid."""
        worst = found.scaled_jacobian
        least = self._least(found.surface) if worst < self.least_jacobian else 0.0
        if worst <= 0 or worst < least:
            needed = f"{least:g} or more" if worst > 0 else "above 0"
            yield f"the smallest scaled Jacobian is {worst:.3f}; it must be {needed}"
        if len(found.crossings):
            place = np.round(found.crossing_at, 3).tolist()
            yield (
                f"the boundary intersects itself: {len(found.crossings)} pairs of quads, the first "
                f"at {place}"
            )
        if len(open_ones):
            yield (
                f"the Jacobian of {len(open_ones)} of {len(found.mesh.hexes)} hexes is not "
                f"positive everywhere; the first is number {open_ones[0]}"
            )
        if self._volume_error(found):
            yield (
                f"the volume is {found.volume_ratio:.1%} of the part's, more than "
                f"{self.volume_limit:.0%} off"
            )
        if found.largest > self.distance_limit:
            yield (
                f"mesh and surface are up to {found.largest:.1%} of the diagonal apart, more than "
                f"{self.distance_limit:.0%}"
            )

    def _warnings(self, found: Inspection) -> Iterator[str]:
        """Warnings about a valid mesh."""
        from polycube.hexmesh.named_sets import face_set

        apart, p99 = found.deviation, found.deviation.p99
        if found.scaled_jacobian < self.poor_jacobian:
            yield (
                f"the smallest scaled Jacobian is {found.scaled_jacobian:.3f}, below "
                f"{self.poor_jacobian:g}"
            )
        if apart.vertices >= self.far_vertices:
            yield (
                f"boundary vertices are up to {apart.vertices:.2%} of the diagonal away from the "
                f"surface, more than {self.far_vertices:.1%}"
            )
        if abs(found.volume_ratio - 1) >= self.far_volume:
            yield (
                f"the volume is {found.volume_ratio:.1%} of the part's, more than "
                f"{self.far_volume:.0%} off"
            )
        for off, limit, length in (
            (found.off_wall, self.far_wall, "wall thickness"),
            (found.off_size, self.far_size, "edge length of the hexes"),
        ):
            if off.share > limit:
                place = np.round(off.place, 3).tolist()
                yield (
                    f"mesh and surface are {off.distance:.3g} apart at {place}, which is "
                    f"{off.share:.0%} of the {length} there, {off.length:.3g}"
                )
                break
        else:
            if found.largest > max(self.distance, self.peak * p99):
                place = np.round(found.farthest_at, 3).tolist()
                yield (
                    f"the largest distance, {found.largest:.2%} of the diagonal at {place}, is far "
                    f"above that of 99 % of the points, {p99:.2%}: something may be missing there"
                )
        lost = self._off(found)
        if lost:
            worst = max(lost, key=lambda each: each.excess(self))
            faces = " and ".join(face_set(found.surface, face) for face in worst.faces)
            yield (
                f"{len(lost)} of {len(found.features)} points, curves and faces of the CAD model "
                f"are lost: farther than {self.features:.1%} of the diagonal or "
                f"{self.feature_share:.0%} of their size; first the {worst.kind} of {faces} at "
                f"{np.round(worst.place, 3).tolist()}, {worst.distance:.2%} of the diagonal away"
            )
        if found.lost_faces:
            names = ", ".join(found.lost_faces[:5]) + ", ..." * (len(found.lost_faces) > 5)
            number = len(found.lost_faces)
            yield f"{number} CAD {'face has' if number == 1 else 'faces have'} no quad: {names}"

    def _lost(self, found: Inspection) -> int:
        """Number of lost points, curves and faces of a CAD part; 0 or 1 for other surfaces."""
        if not len(found.surface.region):
            return int(found.creases > self.features)
        return len(found.lost_faces) + len(self._off(found))

    def _off(self, found: Inspection) -> list[Feature]:
        """Points, curves and faces of a CAD part with a distance above the limit."""
        return [each for each in found.features if each.exceeds(self)]

    def _is_far(self, found: Inspection) -> bool:
        """Whether distances or volume exceed their limits."""
        apart = found.deviation
        return (
            apart.p99 > self.distance
            or apart.vertices > self.far_vertices
            or abs(found.volume_ratio - 1) > self.far_volume
        )
