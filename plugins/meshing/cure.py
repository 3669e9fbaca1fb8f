"""Cure poor hexes one place at a time."""

from __future__ import annotations

from dataclasses import dataclass

from polycube.hexmesh.settings import MeshingSettings, check_features, features_of
from polycube.registry import register, setting
from polycube.types import HexMesh, TriMesh


@register("meshing/cure", "sheets")
@dataclass(frozen=True)
class Sheets:
    """Cure poor hexes one place at a time: fit what is near anew, or put a sheet of hexes there.

    For exact features only; any other mesh stays as it is, and so does one that crosses itself in
    many places.

    Parameters
    ----------
    aim : scaled Jacobian below which a hex is poor
    trials : fits of single places at most
    local_rounds : of the polish that follows, near the worst hexes
    features : exact, soft, off or auto
    """

    aim: float = 0.35
    trials: int = 200
    local_rounds: int = 40
    features: str = setting("meshing.features", MeshingSettings.features)

    def __post_init__(self) -> None:
        check_features(self.features)
        if not 0 <= self.aim <= 1:
            raise ValueError(f"aim must be from 0 to 1; got {self.aim}")
        if self.trials < 0:
            raise ValueError(f"trials must be 0 or more; got {self.trials}")

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The mesh with fewer poor hexes; the same object where nothing helps."""
        from polycube.fitting.cures.cure import cure
        from polycube.fitting.polish import polish
        from polycube.hexmesh.crossings import MANY, crossings
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian
        from polycube.surface.fit_target import target

        if not self.trials or features_of(self.features, surface) != "exact":
            return hexes
        if len(crossings(hexes)) >= MANY:
            return hexes
        goal = target(surface)
        cured = cure(hexes, goal, self.aim, self.trials)
        if cured is hexes:
            return hexes
        polished = polish(
            cured, goal, exact=True, soft_rounds=0, hard_rounds=0, local_rounds=self.local_rounds
        )
        least, before = (
            scaled_jacobian(mesh.vertices, mesh.hexes).min() for mesh in (polished, cured)
        )
        return polished if least > before and not len(crossings(polished)) else cured
