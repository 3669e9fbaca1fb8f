"""Convex cells of a polyhedron."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from polycube.surface.measures import connected, diagonal, face_normals, volume
from polycube.surface.winding import winding_numbers
from polycube.types import TriMesh

from .polyhedron import NotPolyhedralError, Polyhedron

SAME = 1e-7  # of the diagonal: tolerance for equal points, and for points on a plane
PARALLEL = 1e-6  # largest difference of unit normals of one plane
EXACT = 1e-6  # of the volume of the part: permitted error of the sum of the cells

Face = tuple[int, ...]  # points around a convex polygon
Cell = tuple[Face, ...]


@dataclass(frozen=True, eq=False)
class Cells:
    """Convex cells that share whole faces.

    Parameters
    ----------
    points : (N, 3)
    cells : the faces of each cell
    """

    points: np.ndarray
    cells: tuple[Cell, ...]


def sides(face: Face) -> list[tuple[int, int]]:
    """Ends of the sides of a face, in its order."""
    return list(zip(face, (*face[1:], face[0]), strict=True))


def convex_cells(solid: Polyhedron, most: int) -> Cells:
    """Cells of a polyhedron: itself if it is convex, else divided by planes at its reflex edges.

    The plane that bisects the angle of the solid at a reflex edge divides the whole solid, so that
    cells share whole faces.

    Parameters
    ----------
    solid : Polyhedron
    most : largest number of planes

    Raises
    ------
    NotPolyhedralError
        If more planes are needed, or if the result is not convex.
    """
    near = SAME * diagonal(solid.surface)
    planes = _distinct(solid.reflex, near)
    if len(planes) > most:
        raise NotPolyhedralError(
            f"it is not convex and would be cut by {len(planes)} planes, more than {most}"
        )
    points = _apart(np.concatenate([*_points(solid, planes, near)]), near)
    height = np.einsum("npd,pd->np", points[:, None] - planes[:, 0], planes[:, 1])
    side = np.where(abs(height) < near, 0, np.sign(height))
    found, total = [], 0.0
    for signs in product((-1, 1), repeat=len(planes)):
        inside = np.flatnonzero((side * signs >= 0).all(axis=1))
        try:
            hull = ConvexHull(points[inside])
        except (QhullError, ValueError):  # fewer than four points, or coplanar points
            continue
        total += hull.volume
        found.append(_faces(points, inside, hull.equations, near))
    if not np.isclose(total, volume(solid.surface), rtol=EXACT):
        raise NotPolyhedralError(
            "it is not convex, and planes at its reflex edges do not divide it into convex cells"
        )
    if not all(map(_is_closed, found)):
        raise NotPolyhedralError("it has edges or angles that are too small")
    return Cells(points, tuple(found))


def joined(cells: Cells) -> Cells:
    """Merge pairs of cells whose union is convex and shares whole faces with others.

    Planes extend beyond the place where they are needed; this removes the superfluous cuts.
    """
    points, left = cells.points, list(cells.cells)
    near = SAME * float(np.linalg.norm(np.ptp(points, axis=0)))
    while found := next(_unions(points, left, near), None):
        first, second, union = found
        left[first] = union
        del left[second]
    return Cells(points, tuple(left))


def _unions(points: np.ndarray, cells: list[Cell], near: float) -> Iterator[tuple[int, int, Cell]]:
    """Numbers of two cells, ascending, that can be merged, and their union."""
    faces = [{frozenset(face) for face in cell} for cell in cells]
    for first, second in combinations(range(len(cells)), 2):
        if not faces[first] & faces[second]:
            continue
        inside = [np.array(sorted(frozenset().union(*faces[k]))) for k in (first, second)]
        hull = ConvexHull(points[both := np.union1d(*inside)])
        volumes = [ConvexHull(points[each]).volume for each in inside]
        if not np.isclose(hull.volume, sum(volumes), rtol=EXACT):
            continue
        union = _faces(points, both, hull.equations, near)
        others = set().union(*(faces[k] for k in range(len(cells)) if k not in (first, second)))
        is_conforming = others & (faces[first] | faces[second]) <= {
            frozenset(face) for face in union
        }
        if is_conforming and _is_closed(union):
            yield first, second, union


def _distinct(planes: np.ndarray, near: float) -> np.ndarray:
    """Planes (P, 2, 3), a point and a normal, without duplicates of either orientation."""
    distinct: list[np.ndarray] = []
    for point, normal in planes:
        if not any(
            np.linalg.norm(np.cross(normal, other)) < PARALLEL and abs((point - at) @ other) < near
            for at, other in distinct
        ):
            distinct.append(np.stack([point, normal]))
    return np.reshape(distinct, (-1, 2, 3))


def _points(solid: Polyhedron, planes: np.ndarray, near: float) -> Iterator[np.ndarray]:
    """Corners of the cells, with duplicates: (N, 3) each."""
    yield solid.corners
    for point, normal in planes:
        yield _on_edges(solid.edges, point, normal, near)
    for pair in combinations(planes, 2):
        yield _on_faces(solid.surface, *pair, near)
    for three in combinations(planes, 3):
        normals = np.array([normal for _, normal in three])
        if abs(np.linalg.det(normals)) > PARALLEL:
            place = np.linalg.solve(normals, [point @ normal for point, normal in three])[None]
            yield place[winding_numbers(solid.surface, place) > 0.5]


def _on_edges(edges: np.ndarray, point: np.ndarray, normal: np.ndarray, near: float) -> np.ndarray:
    """(N, 3) intersections of a plane with edges (E, 2, 3)."""
    height = (edges - point) @ normal
    crosses = (height[:, 0] * height[:, 1] < 0) & (abs(height).min(axis=1) > near)
    share = height[crosses, 0] / (height[crosses, 0] - height[crosses, 1])
    return edges[crosses, 0] + share[:, None] * (edges[crosses, 1] - edges[crosses, 0])


def _on_faces(surface: TriMesh, one: np.ndarray, other: np.ndarray, near: float) -> np.ndarray:
    """(N, 3) intersections of the line of two planes with triangles or their sides."""
    direction = np.cross(one[1], other[1])
    if np.linalg.norm(direction) < PARALLEL:
        return np.zeros((0, 3))
    system = np.array([one[1], other[1], direction / np.linalg.norm(direction)])
    start = np.linalg.solve(system, [one[0] @ one[1], other[0] @ other[1], 0.0])
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    normal = face_normals(surface)
    steep = normal @ system[2]
    crosses = abs(steep) > PARALLEL
    a, b, c, normal = a[crosses], b[crosses], c[crosses], normal[crosses]
    share = np.einsum("fd,fd->f", a - start, normal) / steep[crosses]
    place = start + share[:, None] * system[2]
    is_in = np.ones(len(place), bool)
    for tail, head in ((a, b), (b, c), (c, a)):
        inward = np.cross(normal, head - tail)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        is_in &= np.einsum("fd,fd->f", place - tail, inward) > -near
    return place[is_in]


def _apart(points: np.ndarray, near: float) -> np.ndarray:
    """Points (N, 3) without duplicates within a distance."""
    first, second = cKDTree(points).query_pairs(near, output_type="ndarray").T
    return points[np.unique(connected(first, second, len(points)), return_index=True)[1]]


def _faces(points: np.ndarray, inside: np.ndarray, equations: np.ndarray, near: float) -> Cell:
    """Faces of a convex cell, each counter-clockwise from outside.

    inside : points of the cell; those that are not corners are ignored
    equations : (T, 4) planes of the triangles of its hull
    """
    normals, distance = equations[:, :3], equations[:, 3]
    on = abs(points[inside] @ normals.T + distance) < 10 * near  # (I, T)
    on, first = np.unique(on, axis=1, return_index=True)
    normals = normals[first]
    is_corner = on.sum(axis=1) > 2
    return tuple(
        _in_order(points, inside[is_corner & round_it], normal)
        for round_it, normal in zip(on.T, normals, strict=True)
    )


def _is_closed(cell: Cell) -> bool:
    """Whether each side of each face is that of one other face in the opposite direction."""
    found = [side for face in cell for side in sides(face)]
    return sorted(found) == sorted({(b, a) for a, b in found})


def _in_order(points: np.ndarray, corners: np.ndarray, normal: np.ndarray) -> Face:
    """Corners of a convex polygon, counter-clockwise seen against its normal."""
    out = points[corners] - points[corners].mean(axis=0)
    across = np.cross(normal, out[0])
    return tuple(corners[np.argsort(np.arctan2(out @ across, out @ out[0]))].tolist())
