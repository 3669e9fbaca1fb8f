"""Sewing of loose faces and sizes of triangles on fillets, in the worker process of gmsh."""

from collections import Counter
from types import ModuleType

import numpy as np

TOLERANCES = (1e-5, 3e-5, 1e-4)  # of the diagonal: gaps that are closed
ROUNDING = 1e-6  # of the diagonal: smaller gaps are not reported
ACROSS = np.linspace(0, 1, 9)  # parameters of the points of an edge where its gap is measured
NEAR = 12  # points of other edges from which the closest one is sought
MOST_OF_ALL = 150_000  # triangles on all round faces, unless that takes less than half the segments
MOST = 2000  # triangles on a fillet, unless they leave it too far
SAGITTA = 5e-4  # of the diagonal: largest distance of larger triangles from a fillet
TURN = 2.0  # largest angle between the ends of a fillet, in radians; rounder faces are not changed
SAMPLES = (np.arange(4) + 0.5) / 4  # parameters where curvatures are measured


def bounded_segments(gmsh: ModuleType, faces: list[int], segments: int, coarse: float) -> int:
    """Edges on a full turn with which round faces have at most `MOST_OF_ALL` triangles together.

    At least half of the requested ones. The parameters are those of `bound_sizes`.
    """
    number = 0.0
    for face in faces:
        bend, area, _ = found = _measures(gmsh, face)
        wanted = 2 * np.pi / (segments * bend)
        if wanted < coarse:
            own = _triangles(area, wanted)
            number += min(own, MOST) if _is_fillet(*found) else own
    return int(np.ceil(max(np.sqrt(MOST_OF_ALL / max(number, MOST_OF_ALL)), 0.5) * segments))


def _measures(gmsh: ModuleType, face: int) -> tuple[float, float, float]:
    """Largest curvature of a face, its area, and the length of its border."""
    own = [tag for _, tag in gmsh.model.getBoundary([(2, face)], oriented=False)]
    around = sum(gmsh.model.occ.getMass(1, edge) for edge in own)
    return _curvature(gmsh, 2, face), gmsh.model.occ.getMass(2, face), around


def _is_fillet(bend: float, area: float, around: float) -> bool:
    return bend * area < TURN * around / 2


def _triangles(area: float, side: float) -> float:
    """Number of triangles with sides of a length on an area."""
    return float(4 / np.sqrt(3) * area / side**2)


def bound_sizes(
    gmsh: ModuleType, faces: list[int], size: float, segments: int, coarse: float
) -> None:
    """Set larger sizes on fillets that would get more than `MOST` triangles.

    faces : tags of all faces of the solid
    size : diagonal of the solid
    segments : requested number of edges on a full turn
    coarse : largest edge of a triangle
    """
    wanted: dict[int, float] = {}
    larger: dict[int, float] = {}
    edges: dict[int, list[int]] = {}  # faces at each edge
    for face in faces:
        own = [tag for _, tag in gmsh.model.getBoundary([(2, face)], oriented=False)]
        for edge in own:
            edges.setdefault(edge, []).append(face)
        bend, area, _ = found = _measures(gmsh, face)
        wanted[face] = min(coarse, 2 * np.pi / (segments * bend))
        number = _triangles(area, wanted[face])
        if number > MOST and _is_fillet(*found):
            limit = min(coarse, np.sqrt(8 * SAGITTA * size / bend))
            larger[face] = max(wanted[face], min(limit, wanted[face] * np.sqrt(number / MOST)))
    if not larger:
        return
    least = {(2, face): value for face, value in larger.items()}
    for edge, own in edges.items():
        if larger.keys() & set(own):
            sizes = [larger.get(face, wanted[face]) for face in own]
            least[1, edge] = min(*sizes, 2 * np.pi / (segments * _curvature(gmsh, 1, edge)))
    gmsh.model.mesh.setSizeCallback(
        lambda dim, tag, x, y, z, found: max(found, least.get((dim, tag), 0.0))
    )


def _curvature(gmsh: ModuleType, dim: int, tag: int) -> float:
    """Largest curvature at points of an edge or a face; not quite 0 if it is straight or flat."""
    low, high = (np.array(end) for end in gmsh.model.getParametrizationBounds(dim, tag))
    grids = np.meshgrid(*(a + (b - a) * SAMPLES for a, b in zip(low, high, strict=True)))
    places = np.stack(grids, axis=-1).ravel()
    return float(np.abs(gmsh.model.getCurvature(dim, tag, places)).max(initial=1e-300))


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
        points.append(gmsh.model.getValue(1, edge, low + (high - low) * ACROSS).reshape(-1, 3))
    from scipy.spatial import cKDTree  # which takes longer to import than most files to read

    places, owner = np.concatenate(points), np.repeat(np.arange(len(edges)), len(ACROSS))
    near = cKDTree(places).query(places, min(NEAR * len(ACROSS), len(places)))[1]
    gaps = np.full(len(places), np.inf)
    for i, place in enumerate(places):
        for k in list(dict.fromkeys(k for k in owner[near[i]].tolist() if k != owner[i]))[:4]:
            closest = gmsh.model.getClosestPoint(1, edges[k], place)[0]
            gaps[i] = min(gaps[i], float(np.linalg.norm(closest - place)))
    finite = np.where(np.isfinite(gaps), gaps, -1)
    return float(finite.max()), places[finite.argmax()]


def diagonal(gmsh: ModuleType) -> float:
    """Length of the diagonal of the box around all shapes."""
    low, high = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
    return float(np.linalg.norm(high - low))
