"""A rough map with its boundary on the surface: charts on the boundary, harmonic inside.

The intervals of the polycube are divided into equal parts. Lattice points on its boundary are
mapped by the charts of the surface; the interior is the discrete harmonic extension.
"""

import numpy as np
from scipy.sparse import csr_matrix

from polycube.charts.harmonic import extend
from polycube.charts.mapped_surface import Sheet
from polycube.hexmesh.connectivity import PLACES
from polycube.hexmesh.generation.template import interval_lengths, map_through, mesh
from polycube.structure.lattice import Boundary
from polycube.structure.rough_map import identity_map
from polycube.surface import closest
from polycube.types import HexMesh, PerAxis, Polycube, RoughMap


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
    weights = lattice_weights(np.stack(scaled, axis=1), hexes.hexes)
    positions = extend(weights, positions, outer)
    return map_through(polycube, rough_map, parts, positions)


def on_surface(hexes: HexMesh, outside: Boundary, sheet: Sheet) -> np.ndarray:
    """(V, 3) positions on the surface of hex vertices, by the charts; zero inside."""
    found = np.zeros_like(hexes.vertices)
    for patch in range(outside.patch.max() + 1):
        faces = sheet.faces[sheet.tag == patch]
        a, b, c = np.moveaxis(sheet.places[faces], 1, 0)
        # without faces that are collapsed to a point
        faces = faces[np.abs(np.cross(b - a, c - a)).sum(axis=1) > 1e-15]
        chart = closest.tree(sheet.places[faces])
        wanted = np.unique(hexes.quads[hexes.patch == patch])
        _, face, weight = closest.closest(chart, hexes.vertices[wanted])
        found[wanted] = np.einsum("nk,nkd->nd", weight, sheet.vertices[faces[face]])
    return found


def lattice_weights(points: np.ndarray, hexes: np.ndarray) -> csr_matrix:
    """(V, V) weights of lattice edges, dual area divided by length: linear maps are harmonic.

    points : (V, 3) lattice points of hexes (H, 8) parallel to the axes
    """
    size = points[hexes[:, 6]] - points[hexes[:, 0]]  # (H, 3)
    rows, columns, values = [], [], []
    for axis in range(3):
        share = size.prod(axis=1) / size[:, axis] ** 2 / 4
        low = np.flatnonzero(PLACES[:, axis] == 0)
        step = np.eye(3, dtype=int)[axis]
        for corner in low:
            other = int((PLACES == PLACES[corner] + step).all(axis=1).argmax())
            rows += [hexes[:, corner], hexes[:, other]]
            columns += [hexes[:, other], hexes[:, corner]]
            values += [share, share]
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix(entries, shape=(len(points), len(points)))
