"""Measures and topology of a triangle surface.

Everything is read off the half-edges of the faces: half-edge 3 f + c runs from corner c of face f
to the next corner.  A solid's boundary is closed (every edge has two faces, run through once each
way), manifold at its vertices (the faces around each form one fan) and in one piece.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from polycube.errors import InputError
from polycube.types import TriMesh

FLAT = 1e-9  # volume over area and diagonal, below which a surface encloses nothing


def area_vectors(surface: TriMesh) -> np.ndarray:
    """(F, 3) normals whose length is the area of the face."""
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    return np.cross(b - a, c - a) / 2


def face_areas(surface: TriMesh) -> np.ndarray:
    """(F,) in the user's units squared."""
    return np.linalg.norm(area_vectors(surface), axis=1)


def face_normals(surface: TriMesh) -> np.ndarray:
    """(F, 3) unit, outward; zero where the face has no area."""
    vectors = area_vectors(surface)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0)


def diagonal(surface: TriMesh) -> float:
    """Length of the diagonal of the bounding box."""
    return float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))


def volume(surface: TriMesh) -> float:
    """Enclosed volume; negative when the faces look inwards."""
    center = surface.vertices.mean(axis=0)  # a far placement would cost digits
    middles = surface.vertices[surface.faces].mean(axis=1) - center
    return float(np.einsum("fi,fi->", area_vectors(surface), middles) / 3)


def genus(surface: TriMesh) -> int:
    """Number of handles of a closed surface, from its Euler number 2 - 2 genus (per component)."""
    n_edges = len(edges(surface.faces)[0])
    euler = len(np.unique(surface.faces)) - n_edges + len(surface.faces)
    return int(components(surface.faces).max() + 1 - euler // 2)


def half_edges(faces: np.ndarray) -> np.ndarray:
    """(3 F, 2) directed edges of (F, 3) faces."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)


def edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (E, 2) with ascending ends, faces per edge (E,), and edge of each half-edge (3 F,)."""
    ends = np.sort(half_edges(faces), axis=1)
    size = int(faces.max(initial=0)) + 1
    keys, edge, count = np.unique(
        ends[:, 0] * size + ends[:, 1], return_inverse=True, return_counts=True
    )
    return np.stack(np.divmod(keys, size), axis=1), count, edge


def open_edges(faces: np.ndarray) -> np.ndarray:
    """(N, 2) edges with one face only."""
    ends, count, _ = edges(faces)
    return ends[count == 1]


def nonmanifold_edges(faces: np.ndarray) -> np.ndarray:
    """(N, 2) edges with more than two faces."""
    ends, count, _ = edges(faces)
    return ends[count > 2]


def nonmanifold_vertices(faces: np.ndarray) -> np.ndarray:
    """(N,) vertices whose faces form more than one fan."""
    _, corner = np.unique(fans(faces), return_index=True)
    vertices, n_fans = np.unique(faces.ravel()[corner], return_counts=True)
    return vertices[n_fans > 1]


def fans(faces: np.ndarray) -> np.ndarray:
    """(3 F,) fan, 0, 1, ..., of faces around a vertex that each corner belongs to."""
    first, second = twins(faces)
    start, after = faces.ravel(), _next(np.arange(faces.size))
    same_way = start[first] == start[second]
    left = np.where(same_way, second, after[second])  # corner of the twin at the start of `first`
    right = np.where(same_way, after[second], second)
    return connected(np.append(first, after[first]), np.append(left, right), faces.size)


def misoriented_edges(faces: np.ndarray) -> np.ndarray:
    """(N, 2) edges that two faces run through the same way."""
    first, second = twins(faces)
    ends = half_edges(faces)
    return ends[first[ends[first, 0] == ends[second, 0]]]


def is_closed(faces: np.ndarray) -> bool:
    """Whether every edge has exactly two faces."""
    return bool((edges(faces)[1] == 2).all())


def components(faces: np.ndarray) -> np.ndarray:
    """(F,) piece of the surface that each face is on, 0, 1, ..., joined through common edges."""
    first, second = twins(faces)
    return connected(first // 3, second // 3, len(faces))


def twins(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half-edges (N,), (N,) that lie on a common edge, in pairs (a chain where more than two)."""
    edge = edges(faces)[2]
    order = np.argsort(edge, kind="stable")
    same = edge[order][1:] == edge[order][:-1]
    return order[:-1][same], order[1:][same]


def _next(half_edge: np.ndarray) -> np.ndarray:
    return half_edge - half_edge % 3 + (half_edge + 1) % 3


def connected(first: np.ndarray, second: np.ndarray, size: int) -> np.ndarray:
    """(size,) component of each node of the graph with the given links."""
    links = coo_array((np.ones(len(first), dtype=bool), (first, second)), shape=(size, size))
    return connected_components(links, directed=False)[1].astype(np.int64)


def check_closed(surface: TriMesh) -> None:
    """Raise InputError, in one sentence, unless every edge has exactly two faces."""
    faces = surface.faces
    _refuse(surface, nonmanifold_edges(faces), "not manifold", "with more than two faces")
    _refuse(surface, open_edges(faces), "not closed", "with one face only")


def check_surface(surface: TriMesh) -> None:
    """Raise InputError, in one sentence, unless the surface bounds one solid."""
    faces = surface.faces
    check_closed(surface)
    _refuse(surface, misoriented_edges(faces), "not oriented", "that both faces run the same way")
    vertices = nonmanifold_vertices(faces)[:, None]
    _refuse(surface, vertices, "not manifold", "where its parts touch in a point only")
    _check_one_piece(surface)
    if not volume(surface) > FLAT * face_areas(surface).sum() * diagonal(surface):
        raise InputError(
            f"the surface encloses no volume: it measures {volume(surface):.3g}, which must be "
            "positive (faces counter-clockwise seen from outside)"
        )


def _refuse(surface: TriMesh, wrong: np.ndarray, what: str, which: str) -> None:
    """Raise about (N, 1) vertices or (N, 2) edges, where there are any."""
    if len(wrong):
        names = ("vertex", "edge") if len(wrong) == 1 else ("vertices", "edges")
        ends = [place(surface, surface.vertices[vertex]) for vertex in wrong[0]]
        where = f"at {ends[0]}" if len(ends) == 1 else f"from {ends[0]} to {ends[1]}"
        items = f"{len(wrong)} {names[wrong.shape[1] - 1]}"
        raise InputError(f"the surface is {what}: {items} {which}, the first {where}")


def _check_one_piece(surface: TriMesh) -> None:
    piece = components(surface.faces)
    sizes = np.bincount(piece)
    if len(sizes) == 1:
        return
    shells = [surface.faces[piece == p] for p in range(len(sizes))]
    spans = [np.ptp(surface.vertices[shell.ravel()], axis=0).sum() for shell in shells]
    inner, outer = np.argsort(spans)[-2:]
    probes = surface.vertices[shells[inner][:: len(shells[inner]) // 8 + 1, 0]]
    if (abs(winding_numbers(TriMesh(surface.vertices, shells[outer]), probes)) > 0.5).all():
        raise InputError(
            f"the solid has an inner void: its piece of {sizes[inner]} faces at "
            f"{place(surface, probes[0])} lies inside another; give a solid without voids"
        )
    smallest = int(np.argmin(sizes))
    raise InputError(
        f"the surface has {len(sizes)} separate pieces, the smallest of {sizes[smallest]} faces "
        f"at {place(surface, surface.vertices[shells[smallest][0, 0]])}; give one solid"
    )


def winding_numbers(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """(N,) how often the surface winds around each of (N, 3) points: 1 inside, 0 outside."""
    return np.array([_solid_angle(surface, point) / (4 * np.pi) for point in points])


def _solid_angle(surface: TriMesh, point: np.ndarray) -> float:
    """Of all faces as seen from the point; tan(angle / 2) of each by van Oosterom and Strackee."""
    rays = surface.vertices[surface.faces] - point  # (F, 3, 3)
    a, b, c = np.moveaxis(rays / diagonal(surface), 1, 0)
    la, lb, lc = (np.linalg.norm(r, axis=1) for r in (a, b, c))
    ab, bc, ca = (np.einsum("fi,fi->f", *pair) for pair in ((a, b), (b, c), (c, a)))
    above = np.einsum("fi,fi->f", a, np.cross(b, c))
    return float(2 * np.arctan2(above, la * lb * lc + ab * lc + bc * la + ca * lb).sum())


def place(surface: TriMesh, point: np.ndarray) -> str:
    """Coordinates (3,) for a sentence; rounding noise reads as zero."""
    tidy = np.where(abs(point) < 1e-9 * diagonal(surface), 0, point)
    return "({:.5g}, {:.5g}, {:.5g})".format(*tidy)
