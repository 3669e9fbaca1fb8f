"""Label the faces of the surface with the faces of the polycube."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np

from polycube.charts.segmentation import segment
from polycube.registry import register
from polycube.structure.lattice import boundary
from polycube.structure.parametrization import unit_normals
from polycube.surface import closest
from polycube.surface.measures import twins
from polycube.types import Labels, Parametrization, Polycube, TriMesh

logger = logging.getLogger(__name__)


@register("meshing/segment", "nearest")
@dataclass(frozen=True)
class Nearest:
    """Label every face with the polycube face nearest to where it lies on the polycube."""

    alpha: float = 0.3  # length that a whole turn of the normal is worth, in cells
    rounds: int = 5  # of the majority vote that removes lone faces

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        """Labels of the surface's faces."""
        outside = boundary(polycube)
        corners = outside.vertices[outside.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)]
        tree = closest.tree(corners, unit_normals(corners))
        placed = parametrization.positions[surface.faces]  # (F, 3, 3)
        normals = unit_normals(placed)
        _, nearest, _ = closest.closest(tree, placed.mean(axis=1), normals, self.alpha)
        patch = majority(outside.patch[nearest // 2], surface.faces, self.rounds)
        axis = np.zeros(outside.patch.max() + 1, np.int64)
        axis[outside.patch] = outside.axis
        n_used = len(np.unique(patch))
        logger.info("segment: %d of %d polycube faces on the surface", n_used, len(axis))
        return Labels(axis[patch], patch)


@register("meshing/segment", "drawn")
@dataclass(frozen=True)
class Drawn:
    """Draw the polycube's edges on the surface; a face has the label of what it mostly lies in.

    Raises MeshingError, naming a polycube face, where the regions are not the polycube's faces.
    """

    alpha: float = 0.3  # length that a whole turn of the normal is worth, in cells
    rounds: int = 5  # of the majority vote, on the labels that guide and on those drawn
    longest: float = 0.02  # edge of the surface when it is cut, in diagonals

    def __post_init__(self) -> None:
        if self.longest <= 0:
            raise ValueError(f"longest must be positive; got {self.longest}")

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        """Labels of the surface's faces."""
        guide = Nearest(self.alpha, self.rounds)(surface, polycube, parametrization)
        drawn = segment(surface, polycube, guide, parametrization, self.longest).labels(surface)
        axis = np.zeros(drawn.patch.max() + 1, np.int64)
        axis[drawn.patch] = drawn.axis
        patch = majority(drawn.patch, surface.faces, self.rounds)  # of faces wider than a patch
        return Labels(axis[patch], patch)


def majority(patch: np.ndarray, faces: np.ndarray, rounds: int) -> np.ndarray:
    """Labels (F,) after votes in which two equal neighbours outvote a face unlike all three."""
    first, second = twins(faces)
    neighbour = np.empty(faces.size, np.int64)  # of each half-edge of a closed surface
    neighbour[first], neighbour[second] = second // 3, first // 3
    neighbour = neighbour.reshape(-1, 3)
    for _ in range(rounds):
        around = patch[neighbour]
        a, b, c = around.T
        winner = np.where((a == b) | (a == c), a, b)
        outvoted = ((a == b) | (a == c) | (b == c)) & (around != patch[:, None]).all(axis=1)
        if not outvoted.any():
            break
        patch = np.where(outvoted, winner, patch)
    return patch
