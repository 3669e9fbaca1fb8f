"""The limits by which a hex mesh is judged: the goal of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.types.options import Share


@dataclass(frozen=True)
class Goal:
    """Limits of a hex mesh. Each limit is defined here only; other modules read it from here.

    Lengths are shares of the diagonal of the bounding box unless another unit is given.

    Parameters
    ----------
    scaled_jacobian : smallest scaled Jacobian that meets the goal if all features of a CAD part are
        on mesh edges
    smooth_jacobian : the same for a surface without CAD faces
    poor_jacobian : a smaller scaled Jacobian gives a warning
    least_jacobian : a mesh with a smaller scaled Jacobian is not valid, unless an angle of the part
        permits no larger one
    features : largest distance of a CAD point, curve or face from mesh vertices, edges and quads
        (the 95th percentile of its samples); without CAD faces, of all sharp edges
    feature_share : the same limit as a share of the size of the feature, if that is smaller: of the
        half radius of a circle, the extent of another curve, or the square root of the area of a
        face
    margin : share of the features that may exceed their limit in a mesh that ends the search,
        weighted by the relative excess
    detail : size of a feature, or width of a face, below which its loss does not keep the search
        going, since no hex is so small
    distance : limit of the 99th percentile of the distance in both directions
    distance_limit : a mesh with a larger distance from the surface is not valid
    far_vertices : a larger distance of a boundary vertex from the surface gives a warning
    volume_limit : a mesh with a larger relative error of the volume is not valid
    far_volume : a larger relative error of the volume gives a warning
    far_wall : a distance above this share of the wall thickness at the same place gives a warning
    far_size : a distance above this share of the edge length at the same place gives a warning
    peak : a largest distance above the 99th percentile times this factor gives a warning, if it is
        also above `distance`
    hexes : number of hexes from which on fewer are better
    many : shortfall for each doubling of that number
    """

    scaled_jacobian: float = 0.5
    smooth_jacobian: float = 0.6
    poor_jacobian: float = 0.2
    least_jacobian: Share = 0.02
    features: float = 0.003
    feature_share: float = 0.2
    margin: float = 0.001
    detail: float = 5e-4
    distance: float = 0.01
    distance_limit: float = 0.05
    far_vertices: float = 0.005
    volume_limit: float = 0.10
    far_volume: float = 0.04
    far_wall: float = 0.4
    far_size: float = 0.6
    peak: float = 8.0
    hexes: int = 3000
    many: float = 0.05
    # below this scaled Jacobian a hex gets most of the work of an improvement
    weak_jacobian: ClassVar[float] = 0.35

    def limit(self, size: np.ndarray | float) -> np.ndarray:
        """Permitted distances of features of given sizes, as shares of the diagonal."""
        return np.minimum(self.features, self.feature_share * size)
