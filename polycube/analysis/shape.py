"""First-order effect of the distance between a spline and its part on a result.

If the boundary moves outwards by d, a compliance changes by the integral of
d (2 f.u - sigma:epsilon), and an eigenvalue lambda of a mode with unit mass by that of
d (sigma:epsilon - lambda rho u.u), over the boundary that is neither loaded nor supported
(Hadamard's formula; Sokolowski and Zolesio 1992).
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import eye

from polycube.analysis.boundary_sets import trace
from polycube.types import Spline

SAFETY = 2.0  # factor of the estimated error, for what the first order does not contain
# relative change of the stress per angle between the normals: 2 at the bottom of a shallow wave of
# a free surface (Gao 1991)
NOTCH = 2.0


def distance_error(spline: Spline, density: np.ndarray) -> np.ndarray:
    """Estimated errors by the distance of the part from the spline.

    That is `SAFETY` times the size of the integral of densities (B, ...) times this distance over
    the boundary; 0 if the distance is not known.
    """
    if not len(spline.offset):
        return np.zeros(density.shape[1:])
    points = spline.extraction @ spline.control
    nodal = replace(spline, control=points, extraction=eye(len(points), format="csr"))
    here = trace(nodal, np.arange(len(spline.sides)))
    return SAFETY * abs((here.area * spline.offset.ravel()) @ (here.shape @ density))
