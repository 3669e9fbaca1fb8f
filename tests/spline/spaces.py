"""Splines to solve on, a patch per smooth side of the solid."""

from functools import reduce

import numpy as np
from scipy.sparse import csr_matrix, kron

from polycube.geometry.hexes import hex_mesh
from polycube.io.hexes import boundary, patches
from polycube.registry import build
from polycube.types import HexMesh, Spline, TriMesh
from tests.hex_solids import hex_box


def spline_of(mesh: HexMesh, space: str = "optimal", **options) -> Spline:
    mesh = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh))
    return build("spline", {"plugin": space, **options})(boundary(mesh), mesh)


def meshed_box(counts, high=(1.0, 1.0, 1.0)) -> tuple[HexMesh, TriMesh]:
    """A box of hexes, a patch per side, and its surface."""
    plain = hex_box(counts, high)
    mesh = hex_mesh(plain.vertices, plain.hexes, plain.quads, patches(plain))
    return mesh, boundary(mesh)


def box(counts, high=(1.0, 1.0, 1.0), space="optimal") -> Spline:
    return spline_of(hex_box(counts, high), space)


def cube(n, space="optimal") -> Spline:
    return box((n, n, n), space=space)


def unclamped(n: int) -> Spline:
    """Unit cube of n^3 elements, uniform B-splines also centred outside: traces depend."""
    rows = np.zeros((3 * n + 1, n + 3))
    pieces = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6
    for element in range(n):
        rows[3 * element : 3 * element + 4, element : element + 4] = pieces
    extraction = csr_matrix(reduce(kron, [csr_matrix(rows)] * 3))  # z slowest
    line = np.arange(-1, n + 2) / n
    control = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)[:, ::-1]
    plain = hex_box((n, n, n))
    start = np.rint(plain.vertices[plain.hexes[:, 0]] * 3 * n).astype(int) @ [
        1,
        3 * n + 1,
        (3 * n + 1) ** 2,
    ]
    local = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), -1).reshape(-1, 3)
    local = local @ [(3 * n + 1) ** 2, 3 * n + 1, 1]
    clamped = box((n, n, n), space="h2s")
    return Spline(
        control=control,
        extraction=extraction,
        nodes=start[:, None] + local,
        element_hex=np.arange(n**3),
        level=np.zeros(n**3),
        sides=clamped.sides,
        patch=clamped.patch,
    )
