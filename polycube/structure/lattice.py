"""Polycubes as boxes on a rectilinear lattice: construction from a context, faces, genus.

Each grid cell contains a primitive, 3 x 3 x 3 voxels with knots at thirds of the cell (paper,
section 3.1). `collapse` removes the knots between equal slabs, so that equal structures have equal
arrays, independent of their contexts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polycube.structure.neighbourhoods import euler_number, solid_genus
from polycube.surface.measures import connected, edges
from polycube.types import Polycube
from polycube.types.checks import Arrays

NAMED = 8  # largest number of cells whose primitives are listed one by one
CORNERS = np.array(  # corners of a box for each outward axis label, counter-clockwise from outside
    [
        [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]],  # +x
        [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0]],  # -x
        [[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]],  # +y
        [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]],  # -y
        [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],  # +z
        [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]],  # -z
    ]
)
OUTWARD = np.kron(np.eye(3, dtype=int), [[1], [-1]])  # (6, 3) direction of each axis label


@dataclass(frozen=True, eq=False)
class Boundary(Arrays):
    """Boundary faces of a polycube; vertices, quads and patches in a fixed order."""

    vertices: Annotated[np.ndarray, "V 3"]
    quads: Annotated[np.ndarray, "Q 4 int"]  # indices of vertices, counter-clockwise from outside
    axis: Annotated[np.ndarray, "Q int"]  # 0..5, outward, see types.AXES
    patch: Annotated[np.ndarray, "Q int"]  # maximal planar connected face
    box: Annotated[np.ndarray, "Q int"]  # of the occupied ones, in the order of np.argwhere

    @property
    def patch_axis(self) -> np.ndarray:
        """(P,) axis label of each patch."""
        return self.axis[np.unique(self.patch, return_index=True)[1]]


def lattice(
    grid: Sequence[int], context: Sequence[str | None], primitives: Mapping[str, np.ndarray]
) -> Polycube:
    """Polycube of a grid whose cells contain the given primitives (None: empty), x slowest.

    primitives : voxels (3, 3, 3) bool for each name; LookupError is raised for an unknown name
    """
    unknown = [name for name in context if name is not None and name not in primitives]
    if unknown:
        raise LookupError(f"no primitive named {unknown[0]!r}; have {', '.join(primitives)}")
    if len(grid) != 3 or len(context) != np.prod(grid):
        what = f"context of grid {tuple(grid)} needs {np.prod(grid)} cells; got {context}"
        raise ValueError(what)
    empty = np.zeros((3, 3, 3), bool)
    cells = np.stack([empty if name is None else primitives[name] for name in context])
    i, j, k = (int(n) for n in grid)
    voxels = cells.reshape(i, j, k, 3, 3, 3).transpose(0, 3, 1, 4, 2, 5)
    x, y, z = (np.arange(3 * n + 1) / 3 for n in (i, j, k))
    return Polycube(voxels.reshape(3 * i, 3 * j, 3 * k), x, y, z, (i, j, k), tuple(context))


def of_bricks(full: np.ndarray, brick: str) -> Polycube:
    """Polycube of bricks (X, Y, Z), each full one a cell with the primitive `brick`."""
    x, y, z = (np.arange(n + 1.0) for n in full.shape)
    context = tuple(brick if is_full else None for is_full in full.ravel().tolist())
    return Polycube(full, x, y, z, full.shape, context)


def describe(polycube: Polycube) -> str:
    """Describe a polycube: the primitives of its cells, or the shape of a large lattice."""
    if len(polycube.context) <= NAMED:
        return ", ".join(name or "-" for name in polycube.context)
    shape = "x".join(map(str, polycube.occupancy.shape))
    return f"{shape} bricks, {int(polycube.occupancy.sum())} full"


def collapse(polycube: Polycube) -> Polycube:
    """The same solid with the smallest number of knots: no empty ends, no equal adjacent slabs."""
    occupancy, knots = polycube.occupancy, list(polycube.knots)
    for axis in range(3):
        slabs = np.moveaxis(occupancy, axis, 0)
        used = np.flatnonzero(slabs.any(axis=(1, 2)))
        slabs = slabs[used[0] : used[-1] + 1]
        knots[axis] = knots[axis][used[0] : used[-1] + 2]
        new = np.append(True, (slabs[1:] != slabs[:-1]).any(axis=(1, 2)))
        occupancy = np.moveaxis(slabs[new], 0, axis)
        knots[axis] = knots[axis][np.append(new, True)]
    x, y, z = knots
    return Polycube(occupancy, x, y, z, polycube.grid, polycube.context)


def boundary(polycube: Polycube) -> Boundary:
    """Faces between solid and outside, sorted by axis label and then by box."""
    occupancy = polycube.occupancy
    axis, place = exposed(occupancy)
    box = (np.cumsum(occupancy) - 1).reshape(occupancy.shape)[tuple(place.T)]
    corners = place[:, None] + CORNERS[axis]  # (Q, 4, 3) lattice indices
    shape = np.array(occupancy.shape) + 1
    used, quads = np.unique(np.ravel_multi_index(corners.T, shape).T, return_inverse=True)
    index = np.unravel_index(used, shape)
    vertices = np.stack([knots[i] for knots, i in zip(polycube.knots, index, strict=True)], 1)
    quads = quads.reshape(-1, 4)
    # two quads that share an edge and have the same orientation are in the same plane
    key = 6 * edges(quads)[2] + np.repeat(axis, 4)
    order = np.argsort(key, kind="stable")
    same = np.diff(key[order]) == 0
    patch = connected(order[:-1][same] // 4, order[1:][same] // 4, len(quads))
    return Boundary(vertices, quads, axis, patch, box)


def exposed(occupancy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Box faces between full and empty: axis label (Q,) and the full box (Q, 3)."""
    boxes, padded = np.argwhere(occupancy), np.pad(occupancy, 1)
    axis, box = np.nonzero([~padded[tuple((boxes + 1 + outward).T)] for outward in OUTWARD])
    return axis, boxes[box]


def nearest_axis(normals: np.ndarray) -> np.ndarray:
    """(N,) axis label of the direction closest to each normal (N, 3)."""
    return (normals @ OUTWARD.T).argmax(axis=1)


def corners(surface: Boundary) -> np.ndarray:
    """(C,) vertices where at least three patches meet."""
    at = np.stack([surface.quads.ravel(), np.repeat(surface.patch, 4)], axis=1)
    vertex, count = np.unique(np.unique(at, axis=0)[:, 0], return_counts=True)
    return vertex[count >= 3]


def genus(polycube: Polycube) -> int:
    """Number of handles of a connected polycube without voids: 1 - (V - E + F - H)."""
    return 1 - euler_number(polycube.occupancy)


def is_manifold(polycube: Polycube) -> bool:
    """Whether the boundary is one connected closed manifold, without voids and pinched points."""
    return solid_genus(polycube.occupancy) is not None


def cell_at(polycube: Polycube, points: np.ndarray) -> np.ndarray:
    """(N,) grid cell, x slowest, that contains each of the points (N, 3) of the polycube."""
    index = np.clip(np.floor(points).astype(int), 0, np.array(polycube.grid) - 1)
    return np.ravel_multi_index(index.T, polycube.grid)


def cell_of_box(polycube: Polycube) -> np.ndarray:
    """(B,) grid cell of the centre of each occupied box, in the order of np.argwhere."""
    middle = [(knots[1:] + knots[:-1]) / 2 for knots in polycube.knots]
    boxes = np.argwhere(polycube.occupancy)
    return cell_at(polycube, np.stack([m[i] for m, i in zip(middle, boxes.T, strict=True)], 1))


def cell_and_wall(polycube: Polycube, surface: Boundary) -> np.ndarray:
    """(2, Q) grid cell of each boundary face, and 1 for a face of a hole, 0 for an outer face.

    A face of a hole faces an occupied cell. All cells must have the same number of boxes, as in a
    polycube from `lattice`; ValueError is raised for a collapsed polycube.
    """
    grid = np.array(polycube.grid)
    size = polycube.occupancy.shape // grid  # number of boxes per cell
    for knots, n_cells, step in zip(polycube.knots, grid, size, strict=True):
        if step == 0 or not np.array_equal(knots[::step], np.arange(n_cells + 1)):
            raise ValueError(f"cells of a collapsed polycube are not known; knots {knots}")
    inside = np.argwhere(polycube.occupancy)[surface.box]  # (Q, 3)
    filled = np.array([name is not None for name in polycube.context]).reshape(grid)
    into = np.pad(filled, 1)[tuple(((inside + OUTWARD[surface.axis]) // size + 1).T)]
    return np.stack([np.ravel_multi_index((inside // size).T, grid), into])
