"""Label the faces of the surface with the faces of the polycube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.charts.segmentation import segment
from polycube.registry import register
from polycube.structure.labels import majority, nearest_labels
from polycube.types import Labels, Parametrization, Polycube, TriMesh


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
        return nearest_labels(surface, polycube, parametrization, self.alpha, self.rounds)


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
