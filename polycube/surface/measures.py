"""Measures and topology of a triangle surface.

All quantities are computed from the half-edges of the faces: half-edge 3 f + c runs from corner c
of face f to the next corner. The boundary of a solid is closed (every edge has two faces that
traverse it in opposite directions), manifold at its vertices (the faces around each vertex form one
fan) and connected.
"""

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from polycube.types import TriMesh


def area_vectors(surface: TriMesh) -> np.ndarray:
    """(F, 3) normals with the area of the face as length."""
    return triangle_vectors(surface.vertices[surface.faces])


def triangle_vectors(corners: np.ndarray) -> np.ndarray:
    """(F, 3) normals of triangles (F, 3, 3) with their areas as lengths."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.cross(b - a, c - a) / 2


def face_areas(surface: TriMesh) -> np.ndarray:
    """(F,) areas of the faces in squared model units."""
    return np.linalg.norm(area_vectors(surface), axis=1)


def face_normals(surface: TriMesh) -> np.ndarray:
    """(F, 3) outward unit normals; zero for a face without area."""
    return unit(area_vectors(surface))


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., D) divided by their lengths; zero for a vector without length."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def frame(axis: np.ndarray) -> np.ndarray:
    """(..., 3, 3) right-handed rows, the last along an axis (..., 3) of length 1."""
    first = unit(np.cross(axis, np.eye(3)[np.argmin(abs(axis), axis=-1)]))
    return np.stack([first, np.cross(axis, first), axis], axis=-2)


def corner_angles(surface: TriMesh) -> np.ndarray:
    """(F, 3) angles of each face at its corners, in radians; 0 at an edge without length."""
    corners = surface.vertices[surface.faces]
    onward = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    return np.arctan2(np.linalg.norm(np.cross(onward, back), axis=2), (onward * back).sum(axis=2))


def diagonal(surface: TriMesh) -> float:
    """Length of the diagonal of the bounding box."""
    return float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))


def volume(surface: TriMesh) -> float:
    """Enclosed volume; negative if the faces are oriented inwards."""
    center = surface.vertices.mean(axis=0)  # reduces rounding errors for a part far from the origin
    middles = surface.vertices[surface.faces].mean(axis=1) - center
    return float(np.einsum("fi,fi->", area_vectors(surface), middles) / 3)


def genus(surface: TriMesh) -> int:
    """Number of handles of a closed surface, from its Euler number 2 - 2 genus (per component)."""
    return int(components(surface.faces).max() + 1 - euler(surface.faces) // 2)


def euler(faces: np.ndarray) -> int:
    """Euler number of polygons (F, K): vertices - edges + faces."""
    return len(np.unique(faces)) - len(edges(faces)[0]) + len(faces)


def half_edges(faces: np.ndarray) -> np.ndarray:
    """(K F, 2) directed edges of (F, K) faces."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)


def edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (E, 2) with ascending ends, number of faces (E,), and edge of each half-edge (K F,)."""
    ends = np.sort(half_edges(faces), axis=1)
    size = int(faces.max(initial=0)) + 1
    number = ends[:, 0] * size + ends[:, 1]
    keys, edge, count = np.unique(number, return_inverse=True, return_counts=True)
    return np.stack(np.divmod(keys, size), axis=1), count, edge


def open_edges(faces: np.ndarray) -> np.ndarray:
    """(N, 2) edges with only one face."""
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
    """(K F,) number of the fan at its vertex, 0, 1, ..., to which each corner belongs."""
    first, second = twins(faces)
    corner = np.arange(faces.size).reshape(faces.shape)
    start, after = faces.ravel(), np.roll(corner, -1, axis=1).ravel()
    same_way = start[first] == start[second]
    left = np.where(same_way, second, after[second])  # corner of the twin at the start of `first`
    right = np.where(same_way, after[second], second)
    return connected(np.append(first, after[first]), np.append(left, right), faces.size)


def misoriented_edges(faces: np.ndarray) -> np.ndarray:
    """(N, 2) edges that two faces traverse in the same direction."""
    first, second = twins(faces)
    ends = half_edges(faces)
    return ends[first[ends[first, 0] == ends[second, 0]]]


def is_closed(faces: np.ndarray) -> bool:
    """Whether every edge has exactly two faces."""
    return bool((edges(faces)[1] == 2).all())


def components(faces: np.ndarray) -> np.ndarray:
    """(F,) component of each face, 0, 1, ..., connected through common edges."""
    first, second = twins(faces)
    return connected(first // faces.shape[1], second // faces.shape[1], len(faces))


def twins(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of half-edges (N,), (N,) on a common edge; a chain of pairs for more than two."""
    edge = edges(faces)[2]
    order = np.argsort(edge, kind="stable")
    same = edge[order][1:] == edge[order][:-1]
    return order[:-1][same], order[1:][same]


def between_faces(
    surface: TriMesh, region: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The pairs (N,), (N,) of `twins` on edges between two CAD faces, or other regions (F,)."""
    first, second = twins(surface.faces)
    region = surface.region if region is None else region
    differ = region[first // 3] != region[second // 3]
    return first[differ], second[differ]


def cad_vectors(surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
    """Sum of the area vectors of each CAD face (R, 3) by its number, and its area (R,)."""
    vectors = area_vectors(surface)
    sums = np.stack([np.bincount(surface.region, column) for column in vectors.T], axis=1)
    return sums, np.bincount(surface.region, np.linalg.norm(vectors, axis=1))


def curved_faces(surface: TriMesh, tolerance: float = 1e-4) -> np.ndarray:
    """Whether each CAD face is not a plane, by its number.

    tolerance : share of its area that a plane may lose in the mean direction
    """
    sums, area = cad_vectors(surface)
    return np.linalg.norm(sums, axis=1) < (1 - tolerance) * area


def connected(first: np.ndarray, second: np.ndarray, size: int) -> np.ndarray:
    """(size,) connected component of each node of the graph with the given links."""
    links = coo_array((np.ones(len(first), dtype=bool), (first, second)), shape=(size, size))
    return connected_components(links, directed=False)[1].astype(np.int64)


def shortest_path(
    graph: csr_array, start: int, end: int, directed: bool = True
) -> tuple[np.ndarray, float]:
    """Nodes of the cheapest path of a graph, and its cost; no nodes if there is none."""
    cost, before = dijkstra(graph, directed, start, return_predecessors=True)
    path = [end]
    while path[-1] != start and path[-1] >= 0:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1] if path[-1] == start else [], np.int64), float(cost[end])


def coincident(points: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """The first of each group of close points, and the number of the group of each point (N,)."""
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    group = connected(pairs[:, 0], pairs[:, 1], len(points))
    return np.unique(group, return_index=True, return_inverse=True)[1:]


def place(surface: TriMesh, point: np.ndarray) -> str:
    """Format coordinates (3,) for a message; rounding errors are shown as zero."""
    tidy = np.where(abs(point) < 1e-9 * diagonal(surface), 0, point)
    return "({:.5g}, {:.5g}, {:.5g})".format(*tidy)


def spread(surface: TriMesh, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) distributed evenly by area, and their faces (N,).

    Faces are chosen in steps of equal area; positions within a face come from a fixed generator.
    """
    area = np.cumsum(face_areas(surface))
    step = (np.arange(number) + 0.381966) / number * area[-1]
    face = np.minimum(np.searchsorted(area, step), len(area) - 1)
    root, share = np.random.default_rng(0).random((2, number, 1))
    root = np.sqrt(root)
    a, b, c = np.moveaxis(surface.vertices[surface.faces[face]], 1, 0)
    return (1 - root) * a + root * (1 - share) * b + root * share * c, face
