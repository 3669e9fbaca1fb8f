"""Surfaces that are polycubes, so that their structure is known."""

from collections.abc import Sequence

import numpy as np

from polycube.geometry.lattice import boundary, lattice
from polycube.registry import build
from polycube.types import Polycube, TriMesh

NAMES = ("cube", "hole_z", "hole_x", "hole_y")
PRIMITIVES = {name: build("primitive", {"plugin": name})() for name in NAMES}
ONE, TWO, THREE = (1, 1, 1), (2, 1, 1), (3, 1, 1)


def part(
    context: Sequence[str | None],
    linear: np.ndarray,
    offset: Sequence[float] = (0, 0, 0),
    grid: tuple[int, int, int] = TWO,
) -> TriMesh:
    """Surface of a context, each quad of a lattice of thirds cut into two triangles, mapped."""
    outside = boundary(lattice(grid, context, PRIMITIVES))
    triangles = outside.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return TriMesh(outside.vertices @ np.transpose(linear) + offset, triangles)


def on_boundary(polycube: Polycube, n: int, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) random points of the boundary, uniform by area."""
    surface = boundary(polycube)
    corner, first, _, last = surface.vertices[surface.quads].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(first - corner, last - corner), axis=1)
    face = rng.choice(len(area), n, p=area / area.sum())
    u, v = rng.random((2, n, 1))
    return corner[face] + u * (first - corner)[face] + v * (last - corner)[face]
