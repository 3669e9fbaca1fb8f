"""Sew the loose faces of a CAD file to a solid, in the worker process of gmsh."""

from collections import Counter
from types import ModuleType

import numpy as np
from scipy.spatial import cKDTree

TOLERANCES = (1e-5, 3e-5, 1e-4)  # of the diagonal: gaps that are closed
ROUNDING = 1e-6  # of the diagonal: smaller gaps are not reported
ACROSS = np.linspace(0, 1, 9)  # parameters of the points of an edge where its gap is measured
NEAR = 12  # points of other edges from which the closest one is sought


def sew(gmsh: ModuleType) -> dict[str, np.ndarray]:
    """Make a solid of faces, if possible; returns their largest `gap` (1,) and `gap_place` (3,)."""
    size = diagonal(gmsh)
    gap, place = _largest_gap(gmsh)
    gap *= gap > ROUNDING * size
    for tolerance in TOLERANCES:
        gmsh.model.occ.healShapes(tolerance=tolerance * size, sewFaces=True, makeSolids=True)
        gmsh.model.occ.synchronize()
        if gmsh.model.getEntities(3):
            break
    return {"gap": np.array([gap]), "gap_place": place}


def _largest_gap(gmsh: ModuleType) -> tuple[float, np.ndarray]:
    """Largest distance of an edge of only one face from other such edges, and the point there."""
    faces = gmsh.model.getEntities(2)
    own = (gmsh.model.getBoundary([face], combined=False, oriented=False) for face in faces)
    owned = [tag for edges in own for _, tag in edges]  # a seam twice
    edges = [tag for tag, count in Counter(owned).items() if count == 1]
    if len(edges) < 2:
        return 0.0, np.zeros(3)
    points = []
    for edge in edges:
        low, high = (float(end[0]) for end in gmsh.model.getParametrizationBounds(1, edge))
        places = gmsh.model.getValue(1, edge, low + (high - low) * ACROSS)
        points.append(np.reshape(places, (-1, 3)))
    places, owner = np.concatenate(points), np.repeat(np.arange(len(edges)), len(ACROSS))
    near = cKDTree(places).query(places, min(NEAR * len(ACROSS), len(places)))[1]
    gaps = np.full(len(places), np.inf)
    for i, place in enumerate(places):
        others = dict.fromkeys(k for k in owner[near[i]].tolist() if k != owner[i])
        for k in list(others)[:4]:
            closest = gmsh.model.getClosestPoint(1, edges[k], place)[0]
            gaps[i] = min(gaps[i], float(np.linalg.norm(closest - place)))
    finite = np.where(np.isfinite(gaps), gaps, -1)
    return float(finite.max()), places[finite.argmax()]


def diagonal(gmsh: ModuleType) -> float:
    """Length of the diagonal of the box around all shapes."""
    low, high = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
    return float(np.linalg.norm(high - low))
