"""Local improvement of poor hexes."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from polycube.hexmesh.settings import Features, features_of
from polycube.registry import register, setting
from polycube.types import Goal, HexMesh, TriMesh
from polycube.types.options import Options, Share, limits


@register("meshing/cure", "sheets")
@dataclass(frozen=True)
class Sheets(Options):
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

    aim: Share = Goal.weak_jacobian
    further: Share = 0.55
    envelope: Annotated[float, limits(0, Goal.features)] = 0.002
    features: Features = setting("meshing.features")

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
