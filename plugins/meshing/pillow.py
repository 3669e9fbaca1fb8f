"""A layer of hexes under the boundary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from polycube.hexmesh.settings import Features, features_of
from polycube.registry import register, setting
from polycube.types import HexMesh, TriMesh
from polycube.types.options import Options

if TYPE_CHECKING:
    from polycube.surface.fit_target import Target


WEIGHT, SLACK = (3.0, 20.0), (0.1, 0.05)  # of the springs, in the first round and in the last


@register("meshing/pillow", "selective")
@dataclass(frozen=True)
class Selective(Options):
    """Add a layer of hexes under chosen patches of the boundary.

    Parameters
    ----------
    patches : auto (all but regions with creases all round; where features are exact, the regions at
        whose borders hexes are nearly flat), all, none
    sheets : where features are exact, under the faces with flat corners: all, polycube (those at
        corners of the polycube, with patches=auto) or none
    sharp : share of the border of two regions that must be on a crease
    depth : thickness of the new layer, as a share of the way to the centres of the hexes
    rounds : rounds of the registration that follows
    iterations : steps of descent in each round
    features : exact, soft, off or auto; exact: the layer is registered with the curves fixed
    """

    references: ClassVar[tuple[str, ...]] = ("mitchell1995pillowing",)

    patches: Literal["auto", "all", "none"] = "auto"
    sheets: Literal["polycube", "all", "none"] = "polycube"
    sharp: float = 0.6
    depth: float = 0.5
    rounds: int = 10
    iterations: int = 25
    features: Features = setting("meshing.features")

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The hexes with the layer, or the same mesh if no patch needs one."""
        from polycube.fitting.flat_corners import without_flat_corners
        from polycube.fitting.pillow import layer
        from polycube.surface.fit_target import target

        goal = target(surface)
        exact = features_of(self.features, surface) == "exact"
        original = hexes
        if exact and self.patches == "auto" and self.sheets != "none":
            hexes = without_flat_corners(hexes, goal, self.sheets == "all")
        region, taken = self._layer_quads(surface, hexes, goal)
        layered = layer(hexes, region, taken, self.depth) if taken.any() else hexes
        if len(layered.hexes) == len(original.hexes):
            return original
        settled = self._registered(layered, goal, exact)
        if not exact or (self.patches, self.sheets) != ("all", "all"):
            return settled
        cured = without_flat_corners(settled, goal, True, keep_paths=True)
        return settled if cured is settled else self._registered(cured, goal, exact)

    def _registered(self, layered: HexMesh, goal: Target, exact: bool) -> HexMesh:
        """A mesh with new layers after a registration."""
        from polycube.fitting.registration import register_mesh
        from polycube.surface.fit_target import ALPHA

        fit = partial(register_mesh, alpha=(ALPHA, ALPHA), weight=WEIGHT, slack=SLACK)
        return fit(layered, goal, self.rounds, self.iterations, features=exact)

    def _layer_quads(
        self, surface: TriMesh, hexes: HexMesh, goal: Target
    ) -> tuple[np.ndarray, np.ndarray]:
        """Regions of the quads, and the quads that get a layer."""
        from polycube.fitting.creases.constraints import match
        from polycube.fitting.pillow import smooth_regions
        from polycube.fitting.problem import FitProblem

        if self.patches != "auto":
            return hexes.patch, np.full(len(hexes.patch), self.patches == "all")
        problem, x = FitProblem(hexes, goal, samples=1), goal.to_unit(hexes.vertices)
        exact = features_of(self.features, surface) == "exact"
        return smooth_regions(problem, x, match(problem, x), self.sharp, exact)
