"""Decides whether a hex mesh is valid, whether it has warnings, and which of two is better."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from polycube.kinds import Acceptance
from polycube.registry import register
from polycube.types import HexMesh, TriMesh, Verdict

if TYPE_CHECKING:
    from polycube.hexmesh.feature_distances import Feature
    from polycube.hexmesh.inspection import Inspection

CRITERIA = ("validity", "features", "distances", "scaled_jacobian")
CERTIFY = ("corners", "everywhere")
POOR = 2  # features that a poor worst hex counts as, where a mesh loses some anyway
DOUBLED = 0.01  # scaled Jacobian that twice as many hexes must gain


@register("acceptance", "standard")
@dataclass(frozen=True)
class Standard(Acceptance):
    """Compare meshes by validity, then preserved features, then distances, then the worst hex.

    A mesh either meets a criterion or does not. For the features of a CAD part, lost features are
    counted: the weight of a feature is its distance divided by the limit, rounded down, and a poor
    worst hex counts as two more features. The better of two meshes is the one that meets the first
    criterion in which they differ, or has the lower count. If they differ in no criterion, the mesh
    with fewer CAD faces without a quad is better, and then the one with the larger merit of the
    fitting stages (`polycube.fitting.merit`), reduced by 0.01 for each doubling of the number of
    hexes. The sharp edges of a surface without CAD faces are found by their angle and are no
    criterion of their own: lost edges count as much as a worst hex below `acceptable`, and a poor
    one counts twice. Lengths are shares of the diagonal of the bounding box unless another unit is
    given.

    Parameters
    ----------
    order : criteria by which the better of two meshes is chosen, the most important first
    certify : where the Jacobian must be positive: at the corners, or everywhere (Bernstein bounds)
    least_jacobian : a mesh with a smaller scaled Jacobian is not valid
    volume_limit : a mesh with a larger relative error of the volume is not valid
    distance_limit : a mesh with a larger distance from the surface, as a share of the diagonal, is
        not valid
    features : limit, as a share of the diagonal, of the 95th percentile of the distance between
        each CAD point, curve or face and the mesh; without CAD faces, between all sharp edges and
        the mesh
    distance : limit, as a share of the diagonal, of the 99th percentile of the distance in both
        directions
    poor_jacobian : a smaller scaled Jacobian gives a warning
    far_vertices : a larger distance of a boundary vertex from the surface, as a share of the
        diagonal, gives a warning
    far_volume : a larger relative error of the volume gives a warning
    far_wall : a distance above this share of the wall thickness at the same place gives a warning
    far_size : a distance above this share of the edge length at the same place gives a warning
    peak : a largest distance above the 99th percentile times this factor gives a warning, if it is
        also above `distance`
    acceptable : from this scaled Jacobian on, no other structure is tried if there are no warnings
    good : from this scaled Jacobian on, no other variant is tried
    excellent : from this scaled Jacobian on, structures with a similar score are not tried either
    """

    order: tuple[str, ...] = CRITERIA
    certify: str = "corners"
    least_jacobian: float = 0.0
    volume_limit: float = 0.10
    distance_limit: float = 0.05
    features: float = 0.003
    distance: float = 0.01
    poor_jacobian: float = 0.2
    far_vertices: float = 0.005
    far_volume: float = 0.04
    far_wall: float = 0.4
    far_size: float = 0.6
    peak: float = 8.0
    acceptable: float = 0.4
    good: float = 0.57
    excellent: float = 0.6

    def __post_init__(self) -> None:
        if sorted(self.order) != sorted(CRITERIA):
            raise ValueError(f"order must name {', '.join(CRITERIA)}, each once; got {self.order}")
        if self.certify not in CERTIFY:
            raise ValueError(f"certify must be {' or '.join(CERTIFY)}; got {self.certify!r}")
        if not 0 <= self.least_jacobian <= 1:
            raise ValueError(f"least_jacobian must be from 0 to 1; got {self.least_jacobian}")

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        """Judge a mesh; see `polycube.types.Verdict`."""
        from polycube.fitting.merit import merit
        from polycube.hexmesh.inspection import inspect

        found, open_ones = inspect(hexes, surface), self._not_certified(hexes)
        lost, weight = self._lost(found), self._weight(found)
        is_poor = found.scaled_jacobian < self.poor_jacobian
        failures = tuple(self._failures(found, open_ones, len(hexes.hexes)))
        is_positive = found.scaled_jacobian > 0 and not len(open_ones)
        levels = {
            # inverted hexes are worse than crossings, these than any other failure
            "validity": -(bool(failures) + 2 * bool(len(found.crossings)) + 4 * (not is_positive)),
            "features": -(weight + POOR * is_poor if weight else 0),
            "distances": -self._is_far(found),
            "scaled_jacobian": -self._shortcomings(found),
        }
        return Verdict(
            failures=failures,
            warnings=() if failures else tuple(self._warnings(found)),
            key=(
                *(float(levels[name]) for name in self.order),
                -float(len(found.lost_faces)),
                merit(found) - DOUBLED * float(np.log2(len(hexes.hexes))),
            ),
            reaches=-inf if lost or any(levels.values()) else found.scaled_jacobian,
            lost=lost if len(surface.region) else 0,
        )

    def _not_certified(self, hexes: HexMesh) -> np.ndarray:
        """Hexes whose Jacobian is not certified to be positive, if `certify` requires it."""
        if self.certify == "corners":
            return np.zeros(0, np.int64)
        from polycube.hexmesh.certificate import certify

        return np.flatnonzero(~certify(hexes.vertices, hexes.hexes).positive)

    def _failures(self, found: Inspection, open_ones: np.ndarray, n_hexes: int) -> Iterator[str]:
        """Reasons why the mesh is not valid."""
        worst = found.scaled_jacobian
        if worst <= 0 or worst < self.least_jacobian:
            needed = f"{self.least_jacobian:g} or more" if worst > 0 else "above 0"
            yield f"the smallest scaled Jacobian is {worst:.3f}; it must be {needed}"
        if len(found.crossings):
            place = np.round(found.crossing_at, 3).tolist()
            yield (
                f"the boundary intersects itself: {len(found.crossings)} pairs of quads, the first "
                f"at {place}"
            )
        if len(open_ones):
            yield (
                f"the Jacobian of {len(open_ones)} of {n_hexes} hexes is not positive "
                f"everywhere; the first is number {open_ones[0]}"
            )
        if abs(found.volume_ratio - 1) > self.volume_limit:
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
        apart = found.deviation
        p99 = max(apart.to_surface.p99, apart.to_mesh.p99)
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
        from polycube.hexmesh.cad_sets import face_set

        lost = self._off(found)
        if lost:
            worst = max(lost, key=lambda each: each.distance)
            faces = " and ".join(face_set(found.surface, face) for face in worst.faces)
            yield (
                f"{len(lost)} of {len(found.features)} points, curves and faces of the CAD model "
                f"are more than {self.features:.1%} of the diagonal away, the farthest is the "
                f"{worst.kind} of {faces} at {np.round(worst.place, 3).tolist()}: "
                f"{worst.distance:.2%}"
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

    def _weight(self, found: Inspection) -> int:
        """Number of lost CAD features, each weighted by its distance divided by the limit."""
        return sum(int(each.distance // self.features) for each in self._off(found))

    def _shortcomings(self, found: Inspection) -> int:
        """1 for a poor worst hex; without CAD faces 1 each for lost edges and not `acceptable`."""
        worst = found.scaled_jacobian
        if len(found.surface.region):
            return int(worst < self.poor_jacobian)
        return (worst < self.poor_jacobian) + (worst < self.acceptable) + self._lost(found)

    def _off(self, found: Inspection) -> list[Feature]:
        """Points, curves and faces of a CAD part with a distance above the limit."""
        return [each for each in found.features if each.distance > self.features]

    def _is_far(self, found: Inspection) -> bool:
        """Whether distances or volume exceed their limits."""
        apart = found.deviation
        return (
            max(apart.to_surface.p99, apart.to_mesh.p99) > self.distance
            or apart.vertices > self.far_vertices
            or abs(found.volume_ratio - 1) > self.far_volume
        )
