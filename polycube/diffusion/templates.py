"""Finely tessellated polycube surfaces, and the same surfaces rounded by implicit smoothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_matrix, csgraph, identity
from scipy.sparse.linalg import splu

from polycube.geometry.lattice import boundary, collapse, lattice
from polycube.types import Polycube, freeze

Context = tuple[str | None, ...]

STEPS_PER_VOXEL = 4
SMOOTHING = (
    0.0,
    0.5,
    1.0,
    2.0,
    4.0,
    8.0,
    16.0,
    32.0,
    64.0,
)  # backward Euler steps of the Laplacian


@dataclass(frozen=True, eq=False)
class Template:
    """Surface of a polycube, centred on its grid, cell edge 1."""

    polycube: Polycube  # collapsed: it has knots only where there is something to see
    vertices: np.ndarray  # (V, 3)
    faces: np.ndarray  # (F, 3) into vertices
    rounded: np.ndarray  # (L, V, 3) vertices after each amount of smoothing, same bounding box

    def __post_init__(self) -> None:
        freeze(
            self,
            vertices=("V 3", np.float64),
            faces=("F 3", np.int64),
            rounded=("L V 3", np.float64),
        )


def contexts(grid: Sequence[int], primitives: Mapping[str, np.ndarray]) -> list[Context]:
    """Every filling of the grid that is one solid without closed voids: 24 for the paper's 2x1."""
    fillings = product((*primitives, None), repeat=int(np.prod(grid)))
    return [c for c in fillings if _is_one_solid(lattice(grid, c, primitives).occupancy)]


def _is_one_solid(occupancy: np.ndarray) -> bool:
    """Whether the solid and the space around it are each connected through voxel faces."""
    return label(occupancy)[1] == 1 and label(~np.pad(occupancy, 1))[1] == 1


def template(
    grid: Sequence[int], context: Context, primitives: Mapping[str, np.ndarray]
) -> Template:
    """Tessellated, rounded surface of one context."""
    voxels = lattice(grid, context, primitives)
    surface = boundary(_refine(voxels, STEPS_PER_VOXEL))
    vertices = surface.vertices - np.array(grid) / 2
    faces = surface.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return Template(collapse(voxels), vertices, faces, _round(vertices, surface.quads))


def _refine(polycube: Polycube, n: int) -> Polycube:
    """The same solid with every box split n times along each axis."""
    occupancy = polycube.occupancy
    for axis in range(3):
        occupancy = occupancy.repeat(n, axis=axis)
    knots = [
        np.interp(np.arange(n * (len(k) - 1) + 1) / n, np.arange(len(k)), k) for k in polycube.knots
    ]
    return Polycube(occupancy, *knots, polycube.grid, polycube.context)


def _round(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """(L, V, 3) vertices after (I + a L)^-1 for each amount a, stretched back to their box."""
    n = len(vertices)
    a, b = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)).tocsr()
    laplacian = csgraph.laplacian(((graph + graph.T) > 0).astype(float))
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    rounded = []
    for amount in SMOOTHING:
        smooth = splu((identity(n) + amount * laplacian).tocsc()).solve(vertices)
        rounded.append((smooth - smooth.min(axis=0)) / np.ptp(smooth, axis=0) * extent + low)
    return np.stack(rounded)
