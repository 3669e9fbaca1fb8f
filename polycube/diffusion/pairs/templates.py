"""Finely tessellated polycube surfaces, and the same surfaces rounded by implicit smoothing."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import Annotated

import numpy as np
from scipy.sparse import coo_matrix, csgraph, identity
from scipy.sparse.linalg import splu

from polycube.structure.lattice import boundary, cell_and_wall, collapse, is_manifold, lattice
from polycube.surface.frames import rotations, turn
from polycube.types import Polycube
from polycube.types.checks import Arrays

Context = tuple[str | None, ...]

ENUMERATED = 5000  # largest number of contexts that are enumerated; above, some are drawn at random
STEPS_PER_VOXEL = 4
# backward Euler steps of the Laplacian
SMOOTHING = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
IDENTITY = 0  # index of the identity in frames.rotations()


@dataclass(frozen=True, eq=False)
class Template(Arrays):
    """Surface of a polycube, centred on its grid, cell edge 1."""

    polycube: Polycube  # collapsed, without superfluous knots
    vertices: Annotated[np.ndarray, "V 3"]
    faces: Annotated[np.ndarray, "F 3 int"]  # into vertices
    rounded: Annotated[np.ndarray, "L V 3 float32"]  # after each smoothing, same bounding box
    axis: Annotated[np.ndarray, "F int"]  # 0..5, outward, of its polycube face, see types.AXES
    cell: Annotated[np.ndarray, "F int"]  # its grid cell, x slowest
    wall: Annotated[np.ndarray, "F int"]  # 1: face of a hole, in an occupied cell; 0: outer face


def contexts(
    grid: Sequence[int], primitives: Mapping[str, np.ndarray], limit: int = 2000
) -> list[Context]:
    """Contexts of the grid that are one manifold solid without voids: 24 for 2x1 in the paper.

    All of them if there are few, else at most `limit`, always the same ones.
    """
    names = (*primitives, None)
    n_cells = int(np.prod(grid))
    if len(names) ** n_cells <= ENUMERATED:
        return [c for c in product(names, repeat=n_cells) if _is_solid(grid, c, primitives)]
    drawn = dict.fromkeys(islice(_fillings(names, n_cells), 50 * limit))
    return list(islice((c for c in drawn if _is_solid(grid, c, primitives)), limit))


def _fillings(names: Sequence[str | None], n_cells: int) -> Iterator[Context]:
    """Endless random contexts, each with few different cells, as those of parts."""
    rng = np.random.default_rng(0)
    while True:
        share = rng.dirichlet(np.full(len(names), 0.2))
        yield tuple(names[i] for i in rng.choice(len(names), n_cells, p=share))


def _is_solid(grid: Sequence[int], context: Context, primitives: Mapping[str, np.ndarray]) -> bool:
    return any(context) and is_manifold(lattice(grid, context, primitives))


def template(
    grid: Sequence[int], context: Context, primitives: Mapping[str, np.ndarray]
) -> Template:
    """Tessellated, rounded, labelled surface of one context."""
    voxels = lattice(grid, context, primitives)
    fine = refined(voxels, STEPS_PER_VOXEL)
    surface = boundary(fine)
    vertices = surface.vertices - np.array(grid) / 2
    faces = surface.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    smooth = np.stack([rounded(vertices, surface.quads, amount) for amount in SMOOTHING])
    labels = np.stack([surface.axis, *cell_and_wall(fine, surface)])
    return Template(collapse(voxels), vertices, faces, smooth, *labels.repeat(2, axis=1))


def refined(polycube: Polycube, n: int) -> Polycube:
    """The same solid with every box divided n times along each axis."""
    occupancy = polycube.occupancy
    for axis in range(3):
        occupancy = occupancy.repeat(n, axis=axis)
    x, y, z = (
        np.interp(np.arange(n * (len(k) - 1) + 1) / n, np.arange(len(k)), k) for k in polycube.knots
    )
    return Polycube(occupancy, x, y, z, polycube.grid, polycube.context)


def rounded(vertices: np.ndarray, faces: np.ndarray, amount: float) -> np.ndarray:
    """Vertices (V, 3) after (I + amount L)^-1, L of the graph of the faces, scaled to their box."""
    n = len(vertices)
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)).tocsr()
    laplacian = csgraph.laplacian(((graph + graph.T) > 0).astype(float))
    smooth = splu((identity(n) + amount * laplacian).tocsc()).solve(vertices)
    low, extent = vertices.min(axis=0), np.ptp(vertices, axis=0)
    return (smooth - smooth.min(axis=0)) / np.ptp(smooth, axis=0) * extent + low


def shape_key(polycube: Polycube) -> bytes:
    """Key of the solid boxes, equal for equal structures with any proportions and position."""
    return _key(collapse(polycube).occupancy)


def _key(boxes: np.ndarray) -> bytes:
    return bytes(boxes.shape) + np.packbits(boxes).tobytes()


def turned_contexts(
    contexts: Sequence[Context], grid: Sequence[int], primitives: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The canonical context of the shape of each context, rotated by each of frames.rotations().

    The canonical context of a shape has the most occupied cells; of several, the first is taken.
    Returns (C, 24, n_cells) int64 numbers of the primitives, len(primitives) for an empty cell; -1
    in all cells if no context has the rotated shape. [:, IDENTITY] are the shapes of the contexts
    themselves.
    """
    index = {name: i for i, name in enumerate((*primitives, None))}
    cells = np.array([[index[name] for name in context] for context in contexts])
    boxes = [collapse(lattice(grid, context, primitives)).occupancy for context in contexts]
    keys = [_key(solid) for solid in boxes]
    canonical: dict[bytes, int] = {}
    for number in np.argsort((cells == index[None]).sum(axis=1), kind="stable"):
        canonical.setdefault(keys[number], number)
    cells = np.vstack([cells, np.full(cells.shape[1], -1)])  # the last one is no context
    turned = {}
    for key, number in canonical.items():
        turned[key] = [canonical.get(_key(turn(boxes[number], r)), -1) for r in rotations()]
    return cells[np.array([turned[key] for key in keys])]
