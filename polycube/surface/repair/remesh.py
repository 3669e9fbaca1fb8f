"""A closed surface around the volume that a triangle soup encloses, on a grid of cells.

Grid points with a winding number above 1/2 are inside. Marching cubes give a closed manifold
between inside and outside. Its vertices are then moved to the soup if it is close, and to its sharp
edges where the planes of the faces around a vertex meet. Vertices whose faces would cross, fold or
become thin are moved back, partly or completely. Details thinner than a cell are lost.
"""

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.sparse import coo_array

from polycube.errors import InputError
from polycube.surface.closest import Tree, closest, tree
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import face_normals, half_edges, unit
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh

SLIDES = 8  # iterations that make the triangles more regular
SHARPENS = 4  # iterations that move vertices to sharp edges
STIFFNESS = 0.05  # stiffness of a vertex in directions that its planes do not determine
EVEN = 0.15  # smallest evenness of a triangle after a move; 1 for equilateral triangles
TURN = 0.3  # smallest cosine between the normals of a face before and after a move
BACK = 10  # iterations that take moves back


def remesh(soup: TriMesh, cell: float) -> TriMesh:
    """Closed, outward-oriented surface with faces of about the width `cell`.

    The faces of the soup must be oriented outwards. Raises InputError if the soup encloses no
    volume as large as a cell.
    """
    start = _marching_cubes(*_signed(soup, cell))
    boxes = tree(soup.vertices[soup.faces], face_normals(soup))
    points = start.vertices
    for _ in range(SLIDES):
        points = _slide(TriMesh(points, start.faces), boxes, cell)
    points = _taken_back(start.vertices, points, start.faces)
    sharp = points
    for _ in range(SHARPENS):
        sharp = _sharpen(TriMesh(sharp, start.faces), boxes, cell)
    return TriMesh(_taken_back(points, sharp, start.faces), start.faces)


def _signed(soup: TriMesh, cell: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Values at the points of a grid, positive inside; its lowest corner; its cell width."""
    low, high = soup.vertices.min(axis=0), soup.vertices.max(axis=0)
    shape = np.ceil((high - low) / cell).astype(int) + 5
    origin = (low + high) / 2 - cell * (shape - 1) / 2 + 1e-4 * cell
    nodes = origin + cell * np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3)
    level = winding_numbers(soup, nodes) - 0.5
    inside = (level > 0).reshape(shape)
    # grid points with a neighbour on the other side
    near = (binary_dilation(inside) != binary_erosion(inside, border_value=1)).ravel()
    value = np.where(level > 0, cell, -cell)
    feet = closest(tree(soup.vertices[soup.faces]), nodes[near])[0]
    away = np.linalg.norm(feet - nodes[near], axis=1)
    most = np.minimum(away, 2 * cell * np.abs(level[near]))  # in a hole, from the winding number
    value[near] = np.sign(value[near]) * np.clip(most, 0.05 * cell, cell)
    return value.reshape(shape), origin, cell


def _marching_cubes(value: np.ndarray, origin: np.ndarray, cell: float) -> TriMesh:
    """The surface of level zero, oriented outward."""
    import igl

    nodes = origin + cell * np.moveaxis(np.indices(value.shape[::-1])[::-1], 0, -1).reshape(-1, 3)
    points, faces, _ = igl.marching_cubes(value.ravel(order="F"), nodes, *value.shape, 0.0)
    if not len(points):
        raise InputError("its faces enclose no volume; give the boundary of a solid")
    return TriMesh(points, faces[:, ::-1])


def _links(faces: np.ndarray, size: int) -> coo_array:
    first, second = half_edges(faces).T
    return coo_array((np.ones(len(first)), (first, second)), shape=(size, size)).tocsr()


def _slide(surface: TriMesh, boxes: Tree, cell: float) -> np.ndarray:
    """Vertices moved halfway to the mean of their neighbours, then onto the soup if it is close."""
    links = _links(surface.faces, len(surface.vertices))
    points = surface.vertices
    normals = np.zeros_like(points)  # of the vertices
    np.add.at(normals, surface.faces, face_normals(surface)[:, None])
    points = (points + links @ points / links.sum(axis=1)[:, None]) / 2
    feet = closest(boxes, points, unit(normals), cell)[0]
    return np.where((np.linalg.norm(feet - points, axis=1) < cell)[:, None], feet, points)


def _sharpen(surface: TriMesh, boxes: Tree, cell: float) -> np.ndarray:
    """Vertices moved by up to half a cell to the intersection of the planes of their faces."""
    points, faces = surface.vertices, surface.faces
    middles = points[faces].mean(axis=1)
    feet, face, _ = closest(boxes, middles, face_normals(surface), cell)
    near = np.linalg.norm(feet - middles, axis=1) < cell
    normals = np.where(near[:, None], boxes.normals[face], face_normals(surface))
    feet = np.where(near[:, None], feet, middles)
    return towards_planes(points, faces, feet, normals, STIFFNESS, cell / 2)


def _taken_back(points: np.ndarray, moved: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The moved points; moves are taken back where faces fold, become thin or cross."""
    share = np.ones((len(points), 1))
    before = TriMesh(points, faces)
    links = _links(faces, len(points))
    even = np.minimum(EVEN, 0.9 * _evenness(points[faces]))
    for round_ in range(BACK):
        there = TriMesh(points + share * (moved - points), faces)
        turned = np.einsum("fi,fi->f", face_normals(there), face_normals(before)) < TURN
        bad = turned | (_evenness(there.vertices[faces]) < even)
        if not bad.any():
            bad[self_intersections(there).ravel()] = True
        if not bad.any():
            return there.vertices
        moving = np.zeros(len(points))
        moving[faces[bad].ravel()] = 1
        for _ in range(round_ // 3):
            moving += links @ moving
        share[moving > 0] = np.where(share[moving > 0] > 0.2, share[moving > 0] / 2, 0)
    there = TriMesh(points + share * (moved - points), faces)
    return points if len(self_intersections(there)) else there.vertices


def _evenness(corners: np.ndarray) -> np.ndarray:
    """(F,) shape of the triangles: 1 for equilateral ones, 0 for flat ones."""
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return 2 * np.sqrt(3) * area / np.maximum((sides**2).sum(axis=(1, 2)), 1e-300)


def towards_planes(
    points: np.ndarray,
    faces: np.ndarray,
    feet: np.ndarray,
    normals: np.ndarray,
    stiffness: float,
    step: float,
) -> np.ndarray:
    """Points moved to the intersection of the planes of their faces.

    Returns (V, 3) the new points.

    points : (V, 3)
    faces : (F, K) indices of the points
    feet, normals : (F, 3) a point and the unit normal of the plane of each face
    stiffness : stiffness of a point in the directions that its planes do not determine
    step : largest length of a move
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
