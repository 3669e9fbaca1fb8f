"""Untangle the hexes and bring their boundary onto the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from polycube.hexmesh.settings import MeshingSettings, check_features, features_of
from polycube.registry import register, setting
from polycube.types import HexMesh, TriMesh

QUICK = 15, 1500  # iterations and samples of the first rounds
# how weak pulls are, and how much normals count, after the first rounds
ALPHA, WEIGHT, SLACK = (0.07, 0.04), (3.0, 20.0), (0.2, 0.05)


@register("meshing/smooth", "register")
@dataclass(frozen=True)
class Register:
    """Untangle the mesh, keep its shape and fit it to the surface.

    Descent of a foldover-free energy with attraction between mesh and surface, both ways.  A few
    quick rounds make the attraction strong before the mesh slides out of its place, as it may in
    many weak rounds; `rounds` of strong ones follow.  Exact features are held from the first quick
    round on, or from the first strong one, whichever finds more paths for the curves.

    Parameters
    ----------
    quick : rounds in which mesh and surface are matched with an attraction that grows from weak to
        strong
    rounds : further rounds with strong attraction; 0: the mesh stays as it is
    iterations : steps of descent in each round
    samples : number of points of the surface that are matched with the mesh
    coverage : weight of their attraction against that of the mesh's vertices
    features : exact, soft, off or auto; exact: vertices are placed on the curves of the surface,
        and those between curves on the CAD face that these enclose
    """

    references: ClassVar[tuple[str, ...]] = ("garanzha2021foldover",)

    quick: int = 7
    rounds: int = 12
    iterations: int = 25
    samples: int = 2500
    coverage: float = 0.5
    features: str = setting("meshing.features", MeshingSettings.features)

    def __post_init__(self) -> None:
        check_features(self.features)

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The same hexes, near the surface; where they were with no rounds."""
        from polycube.fitting.registration import matched_curves, register_mesh
        from polycube.surface.fit_target import target

        if self.rounds == 0:
            return hexes
        goal = target(surface)
        exact = features_of(self.features, surface) == "exact"
        near = register_mesh(
            hexes, goal, self.quick, *QUICK, coverage=self.coverage, features=exact
        )
        if exact and (found := matched_curves(near, goal)) < len(goal.followed.creases):
            free = register_mesh(hexes, goal, self.quick, *QUICK, coverage=self.coverage)
            near = free if matched_curves(free, goal) > found else near
        return register_mesh(
            near,
            goal,
            self.rounds,
            self.iterations,
            self.samples,
            alpha=ALPHA,
            weight=WEIGHT,
            slack=SLACK,
            coverage=self.coverage,
            features=exact,
        )
