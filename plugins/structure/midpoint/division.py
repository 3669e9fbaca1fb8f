"""Hexes of convex cells: one at each corner with three edges (Li, McKeag and Armstrong 1995).

The corners of the hex are the corner of the cell, the midpoints of its three edges, the centres of
its three faces and the centre of the cell. A cell with another kind of corner is first divided into
tetrahedra.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from polycube.hexmesh.scaled_jacobian import scaled_jacobian

from .cells import Cell, Cells, Face, joined, sides


def divided(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and hexes (H, 8) of the division with the largest minimum scaled Jacobian.

    The divisions are: tetrahedra around the centres of cells that need them; the same after merging
    cells; and for a single cell, tetrahedra around each of its corners.
    """
    found = [_hexes(each) for each in _divisions(cells)]
    return max(found, key=lambda mesh: scaled_jacobian(*mesh).min().round(6))


def _divisions(cells: Cells) -> Iterator[Cells]:
    """Divisions into cells all of whose corners have three edges."""
    yield _coned(cells)
    if len(cells.cells) > 1:
        yield _coned(joined(cells))
    if len(cells.cells) == 1 and not _is_simple(cells.cells[0]):
        [cell] = cells.cells
        for tip in sorted({corner for face in cell for corner in face}):
            yield _round_corner(cells.points, cell, tip)


def _is_simple(cell: Cell) -> bool:
    """Whether every corner of a cell has three faces."""
    return set(Counter(corner for face in cell for corner in face).values()) == {3}


def _coned(cells: Cells) -> Cells:
    """Tetrahedra around the centre of every cell with a corner that does not have three edges.

    Faces of such cells get a centre unless they are triangles, so the adjacent cells are divided as
    well.
    """
    undivided = {number for number, cell in enumerate(cells.cells) if _is_simple(cell)}
    while True:
        split = {
            frozenset(face)
            for number, cell in enumerate(cells.cells)
            if number not in undivided
            for face in cell
            if len(face) > 3
        }
        reached = {n for n in undivided if any(frozenset(face) in split for face in cells.cells[n])}
        if not reached:
            break
        undivided -= reached
    points, found = list(cells.points), []
    centre: dict[frozenset[int], int] = {}
    for number, cell in enumerate(cells.cells):
        if number in undivided:
            found.append(cell)
            continue
        middle = _add(points, cells.points[sorted({c for face in cell for c in face})].mean(axis=0))
        for face in cell:
            name = frozenset(face)
            if name in split and name not in centre:
                centre[name] = _add(points, cells.points[list(face)].mean(axis=0))
            found += [_tetrahedron(each, middle) for each in _triangles(face, centre.get(name))]
    return Cells(np.array(points), tuple(found))


def _round_corner(points: np.ndarray, cell: Cell, tip: int) -> Cells:
    """Tetrahedra from a corner of a cell to all faces that do not contain it."""
    added, found = list(points), []
    for face in cell:
        if tip not in face:
            middle = _add(added, points[list(face)].mean(axis=0)) if len(face) > 3 else None
            found += [_tetrahedron(each, tip) for each in _triangles(face, middle)]
    return Cells(np.array(added), tuple(found))


def _add(points: list[np.ndarray], place: np.ndarray) -> int:
    points.append(place)
    return len(points) - 1


def _triangles(face: Face, centre: int | None) -> list[Face]:
    """A face as triangles around its centre, or the face itself without one."""
    return [face] if centre is None else [(a, b, centre) for a, b in sides(face)]


def _tetrahedron(triangle: Face, tip: int) -> Cell:
    """A tetrahedron from a triangle, counter-clockwise from outside, and the opposite corner."""
    return (triangle, *((b, a, tip) for a, b in sides(triangle)))


def _hexes(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and hexes (H, 8), one for each corner of each cell."""
    number: dict[frozenset[int], int] = {}
    places: list[np.ndarray] = []
    hexes = []

    def vertex(*corners: int) -> int:
        """A new vertex at the centre of corners: of an edge, face or cell, or a corner itself."""
        key = frozenset(corners)
        if key not in number:
            number[key] = _add(places, cells.points[list(corners)].mean(axis=0))
        return number[key]

    for cell in cells.cells:
        corners = {corner for face in cell for corner in face}
        face_of_side = {side: face for face in cell for side in sides(face)}
        for corner in sorted(corners):
            ends = [min(end for start, end in face_of_side if start == corner)]
            for _ in range(2):
                face = face_of_side[corner, ends[-1]]
                ends.append(face[face.index(corner) - 1])
            a, b, c = (vertex(corner, end) for end in ends)
            ab, bc, ca = (vertex(*face_of_side[corner, end]) for end in ends)
            hexes.append([vertex(corner), b, ab, a, c, bc, vertex(*sorted(corners)), ca])
    return np.array(places), np.array(hexes)
