"""CAD face of each boundary quad of a hex mesh.

The paths of the curves divide the boundary into parts. A part belongs to the CAD face on which most
of it lies, if every curve of this face has a path; otherwise the part may cover two faces.
"""

from collections.abc import Iterable

import numpy as np

from polycube.fitting.problem import FitProblem
from polycube.surface.curves.coincident import covered
from polycube.surface.curves.features import Crease

NORMAL = 0.04  # weight of the difference of unit normals, a length in diagonals
MOST = 0.5  # smallest share of the area of a part on its CAD face


def quad_faces(
    problem: FitProblem, x: np.ndarray, on_curve: np.ndarray, matched: Iterable[Crease]
) -> np.ndarray:
    """Find the CAD faces of the boundary quads.

    Parameters
    ----------
    problem : the hex mesh and its surface
    x : (V, 3) positions close to the surface, at unit scale
    on_curve : (E,) whether each boundary edge is on the path of a curve
    matched : the curves that have a path

    Returns
    -------
    (Q,) number of the CAD face; 0 if it is unknown
    """
    features, region = problem.target.followed, problem.target.surface.region
    if not features.n_faces:
        return np.zeros(len(problem.quads), np.int64)
    part = problem.parts(~on_curve)
    _, normals = problem.normals(x)
    corners = x[problem.quads]
    _, triangle = problem.target.closest(corners.mean(axis=1), normals, NORMAL)
    cross = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    votes = np.zeros((part.max() + 1, region.max() + 1))
    np.add.at(votes, (part, region[triangle]), np.linalg.norm(cross, axis=1))
    face = votes.argmax(axis=1)
    share = votes.max(axis=1) / np.maximum(votes.sum(axis=1), 1e-300)
    found = {id(crease) for crease in matched}
    is_open = np.zeros(region.max() + 1, bool)
    for crease, is_double in zip(features.creases, covered(features), strict=True):
        if id(crease) not in found and not is_double:
            is_open[list(crease.faces)] = True
    return np.where(is_open[face] | (share <= MOST), 0, face)[part]
