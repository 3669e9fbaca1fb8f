"""Pairs of a geometry and its polycube, point by point: an endless stream with a seed.

Pair i of a stream depends on (seed, i) only, so the pairs do not depend on the number of workers,
and an interrupted training continues with the next pair.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from polycube.diffusion.encoding import box_of, learning_frame, pixels_of
from polycube.diffusion.pairs.deformation import Deformation
from polycube.diffusion.pairs.templates import Context, Template, template
from polycube.surface.measures import unit
from polycube.types import freeze


@dataclass(frozen=True, eq=False)
class Points:
    """Corresponding points of a geometry and of its polycube, both in the learning frame."""

    geometry: np.ndarray  # (N, 3)
    normals: np.ndarray  # (N, 3) outward unit normals of the geometry
    polycube: np.ndarray  # (N, 3)
    labels: np.ndarray  # (N, L) labels of the polycube face, see `conditions`

    def __post_init__(self) -> None:
        freeze(self, geometry="N 3", normals="N 3", polycube="N 3", labels="N L int")


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
        drawn = sampled(shape.faces, surfaces, labels, number, self.deformation, rng)
        return Pair(*drawn, context)

    def shape(self, context: Context, rng: np.random.Generator) -> tuple[Template, np.ndarray]:
        """The polycube of a context, and the places (V, 3) of its vertices on a random geometry."""
        template = self._template(context)
        return template, self.deformation.deform(template, rng)


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
