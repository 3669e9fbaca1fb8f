"""Winding numbers at many points.

The method is that of Barill et al., *Fast winding numbers for soups and clouds*, SIGGRAPH 2018, in
libigl. The winding number is 1 inside a closed surface, 0 outside, and between the two near a hole.
"""

import numpy as np

from polycube.types import TriMesh


def winding_numbers(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """(N,) winding numbers of the surface at points (N, 3), within about 0.01."""
    import igl

    return igl.fast_winding_number(surface.vertices, surface.faces, points)
