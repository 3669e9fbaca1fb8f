"""Local improvement of poor hexes."""

from dataclasses import dataclass
from typing import ClassVar

from polycube.hexmesh.settings import MeshingSettings, check_features, features_of
from polycube.registry import register, setting
from polycube.types import Goal, HexMesh, TriMesh
from polycube.types.checks import check_number


@register("meshing/cure", "sheets")
@dataclass(frozen=True)
class Sheets:
    """Improve poor hexes locally: insert sheets of hexes, and fit the neighbourhood again.

    It is used for exact features only; other meshes are unchanged, as are meshes that cross
    themselves in many places.

    Parameters
    ----------
    aim : scaled Jacobian below which a hex is poor; 0: no hex is improved
    further : scaled Jacobian below which hexes are improved afterwards, as far as half of the
        permitted work allows
    envelope : permitted distance from the surface of the boundary near poor hexes, as a fraction of
        the diagonal, if that improves them and no feature is lost; 0: none
    features : exact, soft, off or auto
    """

    references: ClassVar[tuple[str, ...]] = ("mitchell1995pillowing", "hu2020wild")

    aim: float = Goal.weak_jacobian
    further: float = 0.55
    envelope: float = 0.002
    features: str = setting("meshing.features", MeshingSettings.features)

    def __post_init__(self) -> None:
        from polycube.hexmesh.feature_distances import TOLERANCE

        check_features(self.features)
        for name in ("aim", "further"):
            check_number(name, getattr(self, name), 0, 1)
        check_number("envelope", self.envelope, 0, TOLERANCE)

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The mesh with fewer poor hexes; the same object if there is no improvement."""
        from polycube.fitting.cures.cure import cure
        from polycube.hexmesh.crossings import MOST_CROSSINGS, crossings
        from polycube.surface.fit_target import target

        if not self.aim or features_of(self.features, surface) != "exact":
            return hexes
        if len(crossings(hexes)) >= MOST_CROSSINGS:
            return hexes
        return cure(hexes, target(surface), self.aim, self.envelope, self.further)
