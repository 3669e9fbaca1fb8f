"""Small hex meshes whose measures and singular edges are known."""

import numpy as np

from polycube.geometry.hexes import boundary_quads, hex_mesh
from polycube.types import HexMesh

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)


def hex_box(counts=(2, 2, 2), high=(1.0, 1.0, 1.0)) -> HexMesh:
    """Box from the origin to `high`, vertex (i, j, k) at number (i ny' + j) nz' + k."""
    shape = np.array(counts) + 1
    points = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1).reshape(-1, 1, 3)
    hexes = np.ravel_multi_index(np.moveaxis(cells + CORNERS, -1, 0), shape)
    return hex_mesh(points / counts * high, hexes)


def hex_cylinder(n: int = 2, layers: int = 2, height: int = 2) -> HexMesh:
    """O-grid of radius 1: n^2 core, `layers` rings; four lines of valence 3 inside."""
    core = hex_box((n, n, 1)).vertices.reshape(n + 1, n + 1, 2, 3)[:, :, 0, :2] - 0.5
    square = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([square[:-1, :-1], square[1:, :-1], square[1:, 1:], square[:-1, 1:]], -1)
    rim = np.concatenate([square[:-1, 0], square[-1, :-1], square[:0:-1, -1], square[0, :0:-1]])
    points, quads, base = [core.reshape(-1, 2)], [quads.reshape(-1, 4)], len(square) ** 2
    start = points[0][rim]
    circle = start / np.linalg.norm(start, axis=1, keepdims=True)
    for ring in range(1, layers + 1):
        outer = base + np.arange(len(rim))
        points.append(start + (circle - start) * ring / layers)
        quads.append(np.stack([rim, outer, np.roll(outer, -1), np.roll(rim, -1)], -1))
        rim, base = outer, base + len(rim)
    return _extrude(np.concatenate(points), np.concatenate(quads), height)


def _extrude(points: np.ndarray, quads: np.ndarray, height: int) -> HexMesh:
    levels = np.arange(height + 1)
    x = np.column_stack([np.tile(points, (len(levels), 1)), np.repeat(levels, len(points))])
    low = np.concatenate([quads + level * len(points) for level in levels[:-1]])
    return hex_mesh(x * [1, 1, 0.5], np.concatenate([low, low + len(points)], axis=1))


def hex_ball(n: int = 2) -> HexMesh:
    """Ball of radius 1: n^3 core and two layers round it; valence 3 edges meet at 8 points."""
    mesh = hex_box((n, n, n))
    mesh = hex_mesh(mesh.vertices - 0.5, mesh.hexes)
    for radius in (0.8, 1.0):
        mesh = _layer(mesh, radius)
    return mesh


def _layer(mesh: HexMesh, radius: float) -> HexMesh:
    quads = boundary_quads(mesh.hexes)
    skin, local = np.unique(quads, return_inverse=True)
    outer = mesh.vertices[skin]
    outer = outer * radius / np.linalg.norm(outer, axis=1, keepdims=True)
    shell = np.concatenate([quads, local.reshape(-1, 4) + len(mesh.vertices)], axis=1)
    return hex_mesh(np.concatenate([mesh.vertices, outer]), np.concatenate([mesh.hexes, shell]))


def pillowed_cube(axes: int = 3, n: int = 4) -> HexMesh:
    """Unit cube of n^3 hexes with a layer round the middle ones, in 2 or 3 directions.

    Lines of valence 3 inside the layer and of valence 5 outside; with 3 they meet at 16 points.
    """
    mesh = hex_box((n, n, n))
    x, centre = mesh.vertices, mesh.vertices[mesh.hexes].mean(axis=1)
    inside = (abs(centre[:, :axes] - 0.5) < 0.25).all(axis=1)
    part = np.unique(mesh.hexes[inside])
    far = abs(x[:, :axes] - 0.5).max(axis=1)
    number = np.arange(len(x))
    skin = part[far[part] > far[part].max() - 1e-9]
    number[skin] = len(x) + np.arange(len(skin))
    inner = 0.5 + 0.7 * (x[:, :axes] - 0.5)
    vertices = np.concatenate([x, np.column_stack([inner, x[:, axes:]])[skin]])
    within = np.setdiff1d(part, skin)
    vertices[within, :axes] = inner[within]
    quads = boundary_quads(mesh.hexes[inside])
    quads = quads[(np.isin(quads, skin)).all(axis=1) & ~_flat(x[quads], axes)]
    hexes = mesh.hexes.copy()
    hexes[inside] = number[hexes[inside]]
    return hex_mesh(vertices, np.concatenate([hexes, np.hstack([number[quads], quads])]))


def _flat(corners: np.ndarray, axes: int) -> np.ndarray:
    """(Q,) quads whose corners (Q, 4, 3) agree in one of the last coordinates."""
    return (np.ptp(corners[..., axes:], axis=1) == 0).any(axis=1)
