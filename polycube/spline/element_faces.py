"""Faces of cubic Bezier elements, and those on the boundary."""

import numpy as np

_GRID = np.arange(64).reshape(4, 4, 4)  # [k, j, i]
# (6, 16) nodes of -xi +xi -eta +eta -zeta +zeta, seen from outside, first parameter fastest
FACES = np.stack(
    [
        _GRID[:, :, 0].T.ravel(),
        _GRID[:, :, 3].ravel(),
        _GRID[:, 0, :].ravel(),
        _GRID[:, 3, :].T.ravel(),
        _GRID[0].T.ravel(),
        _GRID[3].ravel(),
    ]
)
_CORNERS = [0, 3, 12, 15]


def unshared_faces(nodes: np.ndarray) -> np.ndarray:
    """(Q, 2) element and local face of faces that no other element shares; nodes (E, 64)."""
    corners = np.sort(nodes[:, FACES[:, _CORNERS]].reshape(-1, 4), axis=1)
    _, inverse, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return np.stack(np.divmod(np.flatnonzero(count[inverse.ravel()] == 1), 6), axis=1)
