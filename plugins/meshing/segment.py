"""Label the faces of the surface with the faces of the polycube."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import Labels, Parametrization, Polycube, TriMesh
from polycube.types.options import Options, Positive


@register("meshing/segment", "nearest")
@dataclass(frozen=True)
class Nearest(Options):
    """Label each face with the polycube face that is nearest to its place on the polycube.

    Parameters
    ----------
    alpha : distance in cells that is equivalent to a unit difference of normals
    rounds : number of rounds of the majority vote that removes single faces
    """

    alpha: float = 0.3
    rounds: int = 5

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        """Labels of the faces of the surface."""
        from polycube.structure.projection import nearest_labels

        return nearest_labels(surface, polycube, parametrization, self.alpha, self.rounds)


@register("meshing/segment", "drawn")
@dataclass(frozen=True)
class Drawn(Nearest):
    """Draw the edges of the polycube on the surface, and label the regions between them.

    Raises MeshingError with a polycube face if the regions do not correspond to the faces.

    Parameters
    ----------
    rounds : number of rounds of the majority vote, on the initial labels and on the result
    longest : longest edge of the surface before it is cut, as a share of the diagonal
    """

    references: ClassVar[tuple[str, ...]] = ("yu2022hexgen",)

    longest: Positive = 0.02

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        """Labels of the faces of the surface."""
        from polycube.charts.segmentation import segment
        from polycube.structure.projection import majority

        guide = super().__call__(surface, polycube, parametrization)
        drawn = segment(surface, polycube, guide, parametrization, self.longest).labels(surface)
        axis = np.zeros(drawn.patch.max() + 1, np.int64)
        axis[drawn.patch] = drawn.axis
        patch = majority(drawn.patch, surface.faces, self.rounds)  # for faces wider than a patch
        return Labels(axis[patch], patch)
