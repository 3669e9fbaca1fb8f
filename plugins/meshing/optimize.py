"""Improve the worst hexes, with the boundary on the surface."""

from dataclasses import dataclass
from functools import partial

from polycube.hexmesh.settings import Features, features_of
from polycube.registry import register, setting
from polycube.types import HexMesh, TriMesh
from polycube.types.options import Options


@register("meshing/optimize", "polish")
@dataclass(frozen=True)
class Polish(Options):
    """Raise the smallest scaled Jacobian, with the boundary on the surface.

    The objective is a soft minimum of the scaled Jacobian; the best mesh of all rounds is kept.

    Parameters
    ----------
    features : exact, soft, off or auto; soft: vertices leave the curves where hexes are poor
    hold : vertices on curved creases and curved CAD faces do not slide, and no crease is recovered
    free_below : scaled Jacobian of hexes beside which held vertices slide in the end, if no more
        features are lost then
    release : with soft features: release all curves from the start
    soft_rounds : rounds with the boundary held by weak springs
    hard_rounds : rounds with the boundary held by strong springs
    local_rounds : largest number of rounds near the worst hexes; they end when nothing improves
    crease_rounds : largest number of rounds that recover released creases; there are none if 95 %
        of the creases are within 0.05 % of the diagonal, or 0.3 % with exact features
    samples : number of points of the surface that are matched with the mesh
    """

    features: Features = setting("meshing.features")
    hold: bool = False
    free_below: float = 0.5
    release: bool = False
    soft_rounds: int = 8
    hard_rounds: int = 4
    local_rounds: int = 40
    crease_rounds: int = 12
    samples: int = 2500

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The same hexes with improved positions; the score never decreases.

        If the boundary crosses itself at a few places, it is repaired there.
        """
        from polycube.fitting.polish import polish
        from polycube.fitting.uncrossing import without_crossings
        from polycube.hexmesh.inspection import inspect
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian
        from polycube.surface.fit_target import target

        goal, mode = target(surface), features_of(self.features, surface)
        polished = partial(
            polish,
            hexes,
            goal,
            features=mode == "exact" or (mode == "soft" and not self.release),
            exact=mode == "exact",
            hold=self.hold,
            soft_rounds=self.soft_rounds,
            hard_rounds=self.hard_rounds,
            local_rounds=self.local_rounds,
            crease_rounds=self.crease_rounds,
            samples=self.samples,
        )
        best = polished()
        if self.hold and scaled_jacobian(best.vertices, best.hexes).min() < self.free_below:
            freer = polished(free_below=self.free_below)
            if inspect(freer, surface).n_lost_features <= inspect(best, surface).n_lost_features:
                best = freer
        return without_crossings(best, goal)
