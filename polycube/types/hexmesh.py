"""Hex meshes, proposed structures and verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Annotated, ClassVar

import numpy as np

from polycube.types.checks import Arrays
from polycube.types.goal import Goal
from polycube.types.polycube import Polycube, RoughMap
from polycube.types.surface import MOST_CAD_FACES


@dataclass(frozen=True, eq=False)
class HexMesh(Arrays):
    """All-hexahedral mesh with the vertex order of VTK.

            7--------6        zeta
           /|       /|         |
          4--------5 |         |  eta
          | 3------|-2         | /
          |/       |/          |/
          0--------1           o---- xi

    `hexmesh.connectivity.hex_mesh` computes `quads`, `patch`, `cell` and `primitives`.

    Parameters
    ----------
    vertices : (V, 3) coordinates in the user's units
    hexes : (H, 8) vertex numbers
    quads : (Q, 4) vertex numbers of the boundary faces, counter-clockwise as seen from outside
    patch : (Q,) number of the polycube face of each quad
    cell : (H,) number of the grid cell of each hex
    primitives : primitive in each grid cell; empty if not known
    warnings : requests that could not be met, one sentence each
    sets : named boundary sets, (N,) numbers of quads (`hexmesh.named_sets.boundary_sets`)
    paths : (N,) vertices on each curve of the surface, in order, by the number of the curve; later
        stages keep them on the curve
    cad_face : (Q,) number of the CAD face of each quad; empty without CAD faces
    cad_names : name in the CAD file of each set that has one
    node_sets : vertices (N,) on each named edge of the CAD file
    ties : pairs of sets of touching solids that move together, first the one whose nodes are bound
    friction : coefficient of friction if the sets of `ties` are in contact; None: they are tied
    name : name of the solid in the CAD file
    unit : length unit of the coordinates, such as mm; empty if it is not known
    """

    vertices: Annotated[np.ndarray, "V 3"]
    hexes: Annotated[np.ndarray, "H 8 int"]
    quads: Annotated[np.ndarray, "Q 4 int"]
    patch: Annotated[np.ndarray, "Q int"]
    cell: Annotated[np.ndarray, "H int"]
    primitives: tuple[str | None, ...] = ()
    warnings: tuple[str, ...] = ()
    sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    paths: Mapping[str, np.ndarray] = field(default_factory=dict)
    cad_face: Annotated[np.ndarray, "Q? int"] = field(default_factory=lambda: np.zeros(0))
    cad_names: Mapping[str, str] = field(default_factory=dict)
    node_sets: Mapping[str, np.ndarray] = field(default_factory=dict)
    ties: tuple[tuple[str, str], ...] = ()
    friction: float | None = None
    name: str = ""
    unit: str = ""

    bounds: ClassVar = {
        **dict.fromkeys(("hexes", "quads", "paths", "node_sets"), "vertices"),
        "sets": "quads",
        "cad_face": MOST_CAD_FACES,
    }


class Tier(IntEnum):
    """How a structure is meshed, and when: groups of structures that are proposed together."""

    EXACT = 0  # hexes of the wanted size, on all curves and faces
    COARSE = 1  # polycubes of few boxes, or blocks
    LEARNED = 2  # coarse structures proposed by a network
    FINE = 3  # lattices with cells of the size of the hexes
    LAST = 4  # substitutes whose genus is not that of the part


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposed structure: a polycube and a rough map from it to the model.

    Parameters
    ----------
    proposal : name of the structure plugin
    polycube : the polycube; a box for structures with `blocks`
    rough_map : rough map of the polycube to the model
    cost : cost given by the plugin, smaller is better; comparable within one plugin only
    key : equal for equal structures in equal orientation
    trajectory : (S, N, 3) states x_T to x_0 of a denoising, in polycube units
    probability : probability of the structure according to a trained network
    steps : (S,) diffusion step t of each state of the trajectory
    tier : group of structures
    variants : name of the list of variants in the meshing bundle
    blocks : coarse hexes of a structure without a polycube, in the user's units
    """

    proposal: str
    polycube: Polycube
    rough_map: RoughMap
    cost: float
    key: str
    trajectory: np.ndarray | None = None
    probability: float | None = None
    steps: tuple[int, ...] = ()
    tier: Tier = Tier.COARSE
    variants: str = "portfolio"
    blocks: HexMesh | None = None


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate, its score, and the coarse mesh from which the score was computed.

    Parameters
    ----------
    candidate : the candidate
    score : smaller is better
    numbers : terms of the score
    hexes : coarse mesh after the short registration, in model units
    positions : (V, 3) polycube position of each vertex of the mesh
    """

    candidate: Candidate
    score: float
    numbers: dict[str, float]
    hexes: HexMesh
    positions: np.ndarray


@dataclass(frozen=True)
class Verdict:
    """Result of the acceptance plugin for a hex mesh.

    Parameters
    ----------
    failures : reasons why the mesh is not valid, one sentence each
    warnings : warnings about a valid mesh, one sentence each
    key : of two meshes, the one with the larger key is better
    shortfall : how far the mesh is from the goal, by criterion; a criterion is absent if it is met
    lost : number of points, curves and faces of a CAD part that are not on the mesh
    goal : limits by which the mesh was judged
    """

    failures: tuple[str, ...]
    warnings: tuple[str, ...]
    key: tuple[float, ...]
    shortfall: Mapping[str, float] = field(default_factory=dict)
    lost: int = 0
    goal: Goal = field(default_factory=Goal)

    @property
    def is_valid(self) -> bool:
        """Whether the mesh is valid."""
        return not self.failures

    def __str__(self) -> str:
        if self.failures:
            return f"not valid: {'; '.join(self.failures)}"
        return "; ".join(["valid", *self.warnings])
