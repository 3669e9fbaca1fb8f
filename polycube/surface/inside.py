"""Points of a rectilinear grid inside a closed surface, by the parity of intersections."""

import numpy as np
from numba import njit

# of a spacing: offset of the scan lines, so that they meet no edge of a part on the grid
OFF = 1.234e-5, 2.345e-5


def inside(triangles: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Test which points of a grid are inside a closed surface.

    Parameters
    ----------
    triangles : (F, 3, 3) corners of a closed surface
    x, y, z : (X,), (Y,), (Z,) coordinates, ascending

    Returns
    -------
    (X, Y, Z) bool
    """
    x, y = (
        at + off * (np.append(np.diff(at), at[-1] - at[-2]) if len(at) > 1 else 1.0)
        for at, off in zip((x, y), OFF, strict=True)
    )
    return _parity(np.ascontiguousarray(triangles), x, y, z)


@njit(cache=True)
def _parity(triangles: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Parity of the number of intersections below each z, for each line (x, y)."""
    crossed = np.zeros((len(x), len(y), len(z) + 1), np.bool_)
    for t in range(len(triangles)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangles[t]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-14 * (abs(bx - ax) + abs(cy - ay) + abs(by - ay) + abs(cx - ax)) ** 2:
            continue
        first = np.searchsorted(x, min(ax, bx, cx))
        after = np.searchsorted(x, max(ax, bx, cx), side="right")
        low = np.searchsorted(y, min(ay, by, cy))
        high = np.searchsorted(y, max(ay, by, cy), side="right")
        for i in range(first, after):
            for j in range(low, high):
                px, py = x[i] - ax, y[j] - ay
                u = (px * (cy - ay) - py * (cx - ax)) / area
                v = ((bx - ax) * py - (by - ay) * px) / area
                if u >= 0 and v >= 0 and u + v <= 1:
                    k = np.searchsorted(z, az + u * (bz - az) + v * (cz - az))
                    crossed[i, j, k] ^= True
    solid = np.zeros((len(x), len(y), len(z)), np.bool_)
    for i in range(len(x)):
        for j in range(len(y)):
            is_inside = False
            for k in range(len(z)):
                is_inside ^= crossed[i, j, k]
                solid[i, j, k] = is_inside
    return solid
