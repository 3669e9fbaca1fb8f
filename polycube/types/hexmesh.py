"""Hex meshes, proposed structures, and how they are judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from polycube.types.checks import freeze
from polycube.types.polycube import Polycube, RoughMap


@dataclass(frozen=True, eq=False)
class HexMesh:
    """All-hex mesh; VTK vertex order, and no other order inside the project.

            7--------6        zeta
           /|       /|         |
          4--------5 |         |  eta
          | 3------|-2         | /
          |/       |/          |/
          0--------1           o---- xi

    `quads` are the boundary faces, counter-clockwise from outside, and `patch` the polycube face
    that each came from; `cell` is the grid cell of each hex and `primitives` the primitive in each
    grid cell (all computed by `hexmesh.connectivity.hex_mesh`).  `warnings` name requests that
    could not be met.  `sets` name parts of the boundary (`hexmesh.named_sets.boundary_sets`).
    `paths` are the vertices on curves of the surface, by the number of the curve, where later
    stages are to keep them there.
    """

    vertices: np.ndarray  # (V, 3)
    hexes: np.ndarray  # (H, 8) into vertices
    quads: np.ndarray  # (Q, 4) into vertices
    patch: np.ndarray  # (Q,)
    cell: np.ndarray  # (H,)
    primitives: tuple[str | None, ...] = ()  # of each grid cell; empty where it is not known
    warnings: tuple[str, ...] = ()  # a sentence each
    sets: Mapping[str, np.ndarray] = field(default_factory=dict)  # quads (N,) by name
    paths: Mapping[str, np.ndarray] = field(default_factory=dict)  # vertices (N,) in order

    def __post_init__(self) -> None:
        freeze(
            self,
            vertices=("V 3", np.float64),
            hexes=("H 8", np.int64),
            quads=("Q 4", np.int64),
            patch=("Q", np.int64),
            cell=("H", np.int64),
        )


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposed structure: a polycube and a rough map from it to the model.

    Where the structure is that of no polycube, `blocks` are coarse hexes that fill the part, from
    which its mesh is made, and the polycube is a box.
    """

    proposal: str  # the structure plugin that made it
    polycube: Polycube
    rough_map: RoughMap
    cost: float  # the proposal's own, smaller is better; comparable within one proposal
    key: str  # equal for equal structures in equal orientation
    trajectory: np.ndarray | None = None  # (S, N, 3) x_T ... x_0 of a denoising, polycube units
    probability: float | None = None  # of the structure, in its frame, by a trained classifier
    steps: tuple[int, ...] = ()  # (S,) t of each state of the trajectory
    family: str = "grid"  # of those that fail alike: contexts of a grid, lattices, labels
    blocks: HexMesh | None = None  # in the user's units


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate, its score and the coarse mesh that was used to judge it."""

    candidate: Candidate
    score: float  # smaller is better
    numbers: dict[str, float]  # the terms of the score
    hexes: HexMesh  # coarse, registered, in model units
    positions: np.ndarray  # (V, 3) polycube position of each vertex of the hexes


@dataclass(frozen=True)
class Verdict:
    """What an acceptance says of a hex mesh."""

    failures: tuple[str, ...]  # why the mesh is not valid, a sentence each
    warnings: tuple[str, ...]  # why a user should look at a valid mesh, a sentence each
    key: tuple[float, ...]  # to choose by: the larger mesh is the better one
    reaches: float  # scaled Jacobian of a mesh that misses nothing else; -inf otherwise
    lost: int = 0  # points, curves and faces of a CAD part that are not on the mesh

    @property
    def is_valid(self) -> bool:
        """Whether the mesh may be used at all."""
        return not self.failures

    def __str__(self) -> str:
        if self.failures:
            return f"not valid: {'; '.join(self.failures)}"
        return "; ".join(["valid", *self.warnings])
