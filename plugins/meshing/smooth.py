"""Untangle the hexes and fit their boundary to the surface."""

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

from polycube.hexmesh.settings import Features, features_of
from polycube.registry import register, setting
from polycube.types import HexMesh, TriMesh
from polycube.types.options import Options

QUICK = 15, 1500  # iterations and samples of the first rounds
# weight of the springs and of the normals after the first rounds
ALPHA, WEIGHT, SLACK = (0.07, 0.04), (3.0, 20.0), (0.2, 0.05)


@register("meshing/smooth", "register")
@dataclass(frozen=True)
class Register(Options):
    """Untangle the mesh, keep its shape and fit it to the surface.

    Descent of a foldover-free energy with springs between mesh and surface in both directions. A
    few quick rounds make the springs strong before the mesh slides along the surface, which may
    happen in many weak rounds; `rounds` of strong ones follow. Exact features are used from the
    first quick round on, or from the first strong one, whichever finds more paths for the curves.

    Parameters
    ----------
    quick : rounds in which mesh and surface are matched with springs that grow from weak to strong
    rounds : further rounds with strong springs; 0: the mesh is not moved, and
        keeps the curves of the surface on the edges on which they are
    iterations : steps of descent in each round
    samples : number of points of the surface that are matched with the mesh
    coverage : weight of their springs relative to those of the vertices of the mesh
    features : exact, soft, off or auto; exact: vertices are placed on the curves of the surface,
        and those between curves on the enclosed CAD face
    """

    references: ClassVar[tuple[str, ...]] = ("garanzha2021foldover",)

    quick: int = 7
    rounds: int = 12
    iterations: int = 25
    samples: int = 2500
    coverage: float = 0.5
    features: Features = setting("meshing.features")

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The same hexes, close to the surface; at their places if `rounds` is 0."""
        from polycube.fitting.creases.recovery import existing_paths
        from polycube.fitting.registration import matched_curves, register_mesh
        from polycube.surface.fit_target import target

        goal = target(surface)
        exact = features_of(self.features, surface) == "exact"
        if self.rounds == 0:
            return replace(hexes, paths=existing_paths(hexes, goal)) if exact else hexes
        fit = partial(register_mesh, coverage=self.coverage)
        near = fit(hexes, goal, self.quick, *QUICK, features=exact)
        if exact and (found := matched_curves(near, goal)) < len(goal.followed.creases):
            free = fit(hexes, goal, self.quick, *QUICK)
            near = free if matched_curves(free, goal) > found else near
        closely = partial(fit, alpha=ALPHA, weight=WEIGHT, slack=SLACK, features=exact)
        return closely(near, goal, self.rounds, self.iterations, self.samples)
