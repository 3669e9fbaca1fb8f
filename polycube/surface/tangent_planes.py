"""Move points to the intersection of the tangent planes around them: recovers sharp edges."""

import numpy as np


def towards_planes(
    points: np.ndarray,
    faces: np.ndarray,
    feet: np.ndarray,
    normals: np.ndarray,
    stiffness: float,
    step: float,
) -> np.ndarray:
    """Points moved to the intersection of the planes of their faces.

    Parameters
    ----------
    points : (V, 3)
    faces : (F, K) indices of the points
    feet, normals : (F, 3) a point and the unit normal of the plane of each face
    stiffness : stiffness of a point in the directions that its planes do not determine
    step : largest length of a move

    Returns
    -------
    (V, 3) the new points
    """
    matrix = np.tile(stiffness * np.eye(3), (len(points), 1, 1))
    vector = np.zeros((len(points), 3))
    for corner in faces.T:
        gap = (normals * (feet - points[corner])).sum(axis=1, keepdims=True)
        np.add.at(matrix, corner, normals[:, :, None] * normals[:, None])
        np.add.at(vector, corner, normals * gap)
    move = np.linalg.solve(matrix, vector[:, :, None])[:, :, 0]
    length = np.linalg.norm(move, axis=1, keepdims=True)
    return points + move * np.minimum(1, step / np.maximum(length, 1e-300))
