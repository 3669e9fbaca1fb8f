"""Harmonic maps with a fixed boundary: of a piece of surface into the plane, of a solid.

Each free vertex is a weighted mean of its neighbours. Cotangent weights have the smallest
distortion; mean-value weights (Floater 2003) are positive, so the map onto a convex domain is
one-to-one.
"""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import splu

from polycube.charts.mapped_surface import Sheet
from polycube.hexmesh.connectivity import EDGES, PLACES
from polycube.hexmesh.generation.template import interval_lengths, map_through, mesh
from polycube.structure.lattice import Boundary
from polycube.structure.rough_map import identity_map
from polycube.surface import closest
from polycube.types import HexMesh, PerAxis, Polycube, RoughMap

STEEP = 1e4  # largest cotangent: flatter corners are treated as having this value


def cotangent(corners: np.ndarray, faces: np.ndarray, n: int) -> csr_matrix:
    """(n, n) weights (cot a + cot b) / 2 of edges, with the opposite angles a and b.

    corners : (F, 3, 3) positions of the faces (F, 3)
    """
    ends = ((faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]) for k in range(3))
    found = _matrix([(*pair, _cotangents(corners, k) / 2) for k, pair in enumerate(ends)], n)
    return found + found.T


def _matrix(entries: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], n: int) -> csr_matrix:
    """(n, n) sum of entries, given by rows, columns and values."""
    rows, columns, values = map(np.concatenate, zip(*entries, strict=True))
    return csr_matrix((values, (rows, columns)), shape=(n, n))


def _cotangents(corners: np.ndarray, k: int) -> np.ndarray:
    """(F,) cotangents of the angle at corner k of each face."""
    a, b = (corners[:, (k + step) % 3] - corners[:, k] for step in (1, 2))
    along, across = np.einsum("fd,fd->f", a, b), np.linalg.norm(np.cross(a, b), axis=1)
    return along / np.maximum(across, np.maximum(np.abs(along), 1e-300) / STEEP)


def mean_value(corners: np.ndarray, faces: np.ndarray, n: int) -> csr_matrix:
    """(n, n) weights (tan a/2 + tan b/2) / length, with the angles a and b beside the edge."""
    entries = []
    for k in range(3):
        cot = _cotangents(corners, k)
        half = np.sqrt(1 + cot**2) - cot  # tan(angle / 2), from 0 to infinity
        for other in ((k + 1) % 3, (k + 2) % 3):
            length = np.linalg.norm(corners[:, other] - corners[:, k], axis=1)
            entries.append((faces[:, k], faces[:, other], half / np.maximum(length, 1e-300)))
    return _matrix(entries, n)


def extend(weights: csr_matrix, values: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """(n, D) values that are weighted means of their neighbours except at fixed vertices (n,)."""
    free = np.flatnonzero(~fixed)
    found = values.copy()
    if len(free) == 0:
        return found
    operator = (diags(np.asarray(weights.sum(axis=1)).ravel()) - weights).tocsr()[free]
    given = operator[:, np.flatnonzero(fixed)] @ values[fixed]
    found[free] = splu(operator[:, free].tocsc()).solve(-given)
    return found


def flipped(plane: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F,) whether each face of a plane map (V, 2) is clockwise, up to rounding errors."""
    a, b, c = np.moveaxis(plane[faces], 1, 0)
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return twice < -1e-12 * np.ptp(plane[faces].reshape(-1, 2), axis=0).prod()


def chart_map(
    polycube: Polycube, outside: Boundary, sheet: Sheet, rough_map: RoughMap, parts: PerAxis
) -> RoughMap:
    """Trilinear map on the lattice with the given parts per interval; `rough_map` outside the
    solid.

    sheet : the surface flattened onto the boundary of the polycube, with the patches as tags
    """
    hexes = mesh(polycube, identity_map(polycube), parts)
    positions = on_surface(hexes, outside, sheet)
    sizes = [interval_lengths(polycube, rough_map, axis) for axis in range(3)]
    scaled = [  # lattice coordinates in model lengths, so that the interior keeps its proportions
        np.interp(hexes.vertices[:, axis], knots, np.append(0, np.cumsum(sizes[axis])))
        for axis, knots in enumerate(polycube.knots)
    ]
    outer = np.isin(np.arange(len(hexes.vertices)), hexes.quads)
    positions = extend(lattice_weights(np.stack(scaled, axis=1), hexes.hexes), positions, outer)
    return map_through(polycube, rough_map, parts, positions)


def on_surface(hexes: HexMesh, outside: Boundary, sheet: Sheet) -> np.ndarray:
    """(V, 3) positions on the surface of hex vertices, by the charts; zero inside."""
    found = np.zeros_like(hexes.vertices)
    for patch in range(outside.patch.max() + 1):
        faces = sheet.faces[sheet.tag == patch]
        a, b, c = np.moveaxis(sheet.places[faces], 1, 0)
        # without faces that are collapsed to a point
        faces = faces[np.abs(np.cross(b - a, c - a)).sum(axis=1) > 1e-15]
        wanted = np.unique(hexes.quads[hexes.patch == patch])
        _, face, weight = closest.closest(closest.tree(sheet.places[faces]), hexes.vertices[wanted])
        found[wanted] = np.einsum("nk,nkd->nd", weight, sheet.vertices[faces[face]])
    return found


def lattice_weights(points: np.ndarray, hexes: np.ndarray) -> csr_matrix:
    """(V, V) weights of lattice edges, dual area divided by length: linear maps are harmonic.

    points : (V, 3) lattice points of hexes (H, 8) parallel to the axes
    """
    size = points[hexes[:, 6]] - points[hexes[:, 0]]  # (H, 3)
    entries = []
    for start, end in EDGES:
        axis = int((PLACES[end] - PLACES[start]).argmax())
        entries.append((hexes[:, start], hexes[:, end], size.prod(axis=1) / size[:, axis] ** 2 / 4))
    found = _matrix(entries, len(points))
    return found + found.T
