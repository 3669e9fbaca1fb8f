"""A spline element by element, as other codes see it."""

import numpy as np

from polycube.spline.bernstein import volume_basis
from polycube.spline.bezier import bezier_points
from polycube.types import Spline


def sampled(spline: Spline, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (E, P, 3) and all functions (E, P, C) on the grid line^3 of each element."""
    values, _ = volume_basis(line)
    functions = spline.extraction.toarray()[spline.nodes]
    return values @ bezier_points(spline), values @ functions
