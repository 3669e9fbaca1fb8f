"""Pairs of a geometry and its polycube on a grid, point by point: endless streams with a seed.

Pair i of a stream depends on (seed, i) only, so the pairs do not depend on the number of workers,
and an interrupted training continues with the next pair.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np

from polycube.diffusion.encoding import POINTS_PER_CELL, box_of, learning_frame, pixels_of
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.templates import Context, Template, refined, rounded, template
from polycube.structure.lattice import boundary, cell_and_wall, lattice
from polycube.surface.measures import triangle_vectors, unit
from polycube.types.checks import Arrays

PIECES = (3, 2)  # of the edge of a voxel: a full cell has 488 vertices, one with a hole 256


@dataclass(frozen=True, eq=False)
class Points(Arrays):
    """Corresponding points of a geometry and of its polycube, both in the learning frame."""

    geometry: Annotated[np.ndarray, "N 3"]
    normals: Annotated[np.ndarray, "N 3"]  # outward unit normals of the geometry
    polycube: Annotated[np.ndarray, "N 3"]
    labels: Annotated[np.ndarray, "N L int"]  # labels of the polycube face, see `conditions`


@dataclass(frozen=True, eq=False)
class Pair(Points):
    """Points of a context; the labels are the outward axis, the cell, and 1 in a hole."""

    context: Context


class Pairs:
    """Templates of the given contexts, in rotation and with random deformations."""

    def __init__(
        self,
        grid: Sequence[int],
        primitives: Mapping[str, np.ndarray],
        contexts: Sequence[Context],
        deformation: Deformation,
        seed: int,
    ) -> None:
        self.grid, self.contexts = tuple(grid), list(contexts)
        self.deformation, self.seed, self.pads = deformation, seed, False
        self._template = cache(lambda context: template(grid, context, primitives))

    def __call__(self, index: int) -> Pair:
        """Pair number `index` >= 0: points distributed evenly by the area of the geometry."""
        rng = np.random.default_rng([self.seed, index])
        context = self.contexts[index % len(self.contexts)]
        shape, deformed = self.shape(context, rng)
        box = box_of(self.grid, context, self.pads)
        deformed = learning_frame(deformed, box=box).apply(deformed)
        labels = np.stack([shape.axis, shape.cell, shape.wall], axis=1)
        surfaces, number = (deformed, shape.vertices), len(pixels_of(context, self.pads))
        return Pair(*sampled(shape.faces, surfaces, labels, number, self.deformation, rng), context)

    def shape(self, context: Context, rng: np.random.Generator) -> tuple[Template, np.ndarray]:
        """The polycube of a context, and the places (V, 3) of its vertices on a random geometry."""
        template = self._template(context)
        return template, self.deformation.deform(template, rng)


def cell_mesh(voxels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mesh of a primitive in a cell of edge 1: vertices (512, 3), faces (F, 3), labels (512, 2).

    The voxels (3, 3, 3) are divided as finely as the number of vertices allows. Evenly chosen quads
    then get a vertex in their middle, and are divided into four triangles instead of two. The
    labels of a vertex are the axis of one of its faces, and 1 if this is the face of a hole.
    """
    solid = lattice((1, 1, 1), ("cell",), {"cell": voxels})
    for pieces in PIECES:
        fine = refined(solid, pieces)
        surface = boundary(fine)
        missing = POINTS_PER_CELL - len(surface.vertices)
        if 0 <= missing <= len(surface.quads):
            break
    else:
        raise ValueError(f"no mesh of {POINTS_PER_CELL} vertices for this primitive")
    quads = surface.quads
    chosen = np.linspace(0, len(quads), missing, endpoint=False).astype(int)
    middle = len(surface.vertices) + np.arange(missing)
    corners, others = quads[chosen], np.delete(quads, chosen, axis=0)
    fans = np.stack([corners, np.roll(corners, -1, axis=1), middle[:, None].repeat(4, 1)], axis=2)
    faces = np.concatenate([others[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), fans.reshape(-1, 3)])
    vertices = np.vstack([surface.vertices, surface.vertices[corners].mean(axis=1)])
    of_quad = np.stack([surface.axis, cell_and_wall(fine, surface)[1]], axis=1)
    labels = np.empty((POINTS_PER_CELL, 2), np.int64)
    labels[quads], labels[middle] = of_quad[:, None], of_quad[chosen]
    return vertices, faces, labels


class MeshPairs:
    """Pairs as published: meshes of fixed vertices, with the same numbers on both shapes.

    A cell is a mesh of 512 vertices of its primitive, and its geometry is the same mesh rounded by
    smoothing, in the same box. Meshes of several cells stand beside each other. The contexts take
    turns, and the pairs of a context are all equal: that vertex i of the geometry belongs to vertex
    i of the polycube is all a network learns besides the noise of the diffusion.

    rounding : amount of smoothing, see `templates.rounded`
    """

    def __init__(
        self,
        grid: Sequence[int],
        primitives: Mapping[str, np.ndarray],
        contexts: Sequence[Context],
        rounding: float,
    ) -> None:
        self.grid, self.contexts = tuple(grid), list(contexts)
        self.primitives, self.rounding = primitives, rounding
        self._pair = cache(self._made)

    def __call__(self, index: int) -> Pair:
        """Pair number `index` >= 0, in the box of its cells."""
        return self._pair(self.contexts[index % len(self.contexts)])

    def _made(self, context: Context) -> Pair:
        rows = []
        for cell, name in enumerate(context):
            if name is not None:
                vertices, faces, labels = cell_mesh(self.primitives[name])
                corner = np.array(np.unravel_index(cell, self.grid)) - np.array(self.grid) / 2
                smooth = rounded(vertices, faces, self.rounding)
                normals = np.zeros_like(smooth)
                np.add.at(normals, faces, triangle_vectors(smooth[faces])[:, None])
                labels = np.insert(labels, 1, cell, axis=1)
                rows.append((smooth + corner, unit(normals), vertices + corner, labels))
        geometry, normals, polycube, labels = map(np.concatenate, zip(*rows, strict=True))
        return Pair(geometry, normals, polycube, labels, context)


def sample(
    faces: np.ndarray, vertices: np.ndarray, n_points: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Random points on triangles, uniform by area: face (N,) and barycentric weights (N, 3)."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).cumsum()
    face = np.searchsorted(area, rng.uniform(0, area[-1], n_points))
    root, v = np.sqrt(rng.random(n_points)), rng.random(n_points)
    return face, np.stack([1 - root, root * (1 - v), root * v], axis=1)


def sampled(
    faces: np.ndarray,
    surfaces: tuple[np.ndarray, np.ndarray],
    labels: np.ndarray,
    n_points: int,
    noise: Deformation,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The fields of `Points`, with the roughness and the tilt of a deformation.

    surfaces : vertices (V, 3) of the geometry and of the polycube
    labels : (F, L) of the faces
    """
    face, weights = sample(faces, surfaces[0], n_points, rng)
    geometry, polycube = (np.einsum("nk,nkd->nd", weights, x[faces[face]]) for x in surfaces)
    a, b, c = surfaces[0][faces[face]].transpose(1, 0, 2)
    rough, tilt = rng.uniform(0, [noise.roughness, noise.tilt])
    geometry = geometry + rng.normal(0, rough, geometry.shape)
    normals = unit(unit(np.cross(b - a, c - a)) + rng.normal(0, tilt, geometry.shape))
    return geometry, normals, polycube, labels[face]
