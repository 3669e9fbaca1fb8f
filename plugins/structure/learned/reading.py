"""What a network drew for sample points of a part, read off at its triangles and vertices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from polycube.diffusion.encoding import learning_frame
from polycube.registry import build
from polycube.surface.measures import face_areas, face_normals
from polycube.types import TriMesh

from .hypotheses import sample

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

NEAR = 4  # sample points that speak for a triangle
LOOK = 0.2  # distance, in units of the surface, that opposite normals count for
READ = 0.2  # share of the steps at which the labels of a draw are read


@dataclass(frozen=True, eq=False)
class Reading:
    """One draw of the network: axes and places of sample points, in the frame of the surface."""

    points: np.ndarray  # (N, 3)
    normals: np.ndarray  # (N, 3)
    log_axis: np.ndarray  # (N, 6) log-probabilities of the axes of types.AXES
    moved: np.ndarray  # (N, 3) from the points to their places on the polycube

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(np.hstack([self.points, LOOK / 2 * self.normals]))

    def axes(self, surface: TriMesh) -> np.ndarray:
        """(F, 6) log-probabilities of the triangles: the mean of those of points near them."""
        return self.log_axis[self._near(surface)].mean(axis=1)

    def places(self, surface: TriMesh) -> np.ndarray:
        """(V, 3) places of the vertices on the polycube, moved as the triangles around them are."""
        weight = np.repeat(face_areas(surface), 3)
        moved = np.repeat(self.moved[self._near(surface)].mean(axis=1), 3, axis=0)
        number = len(surface.vertices)
        total = np.bincount(surface.faces.ravel(), weight, number)
        sums = [np.bincount(surface.faces.ravel(), weight * m, number) for m in moved.T]
        return surface.vertices + np.transpose(sums) / np.maximum(total, 1e-30)[:, None]

    def _near(self, surface: TriMesh) -> np.ndarray:
        """(F, NEAR) sample points near the triangles, and on their side of a wall."""
        middle = surface.vertices[surface.faces].mean(axis=1)
        there = np.hstack([middle, LOOK / 2 * face_normals(surface)])
        return self._tree.query(there, k=NEAR)[1]


def readings(
    denoiser: Denoiser,
    surface: TriMesh,
    genus: int,
    sampler: Mapping[str, object],
    draws: int,
    clouds: int,
    seed: int,
) -> list[Reading]:
    """Draws for a surface in a frame, each of several clouds of sample points of its own."""
    number = draws * clouds
    rng = np.random.default_rng(seed)
    sampled = [sample(surface, denoiser.n_points(genus), rng) for _ in range(number)]
    points, normals = (np.stack(rows) for rows in zip(*sampled, strict=True))
    frame = learning_frame(surface.vertices)
    seen = frame.apply(points)
    drawn = denoiser.denoise(
        seen, normals, [genus] * number, build("sampler", sampler), seed, read=READ
    )
    rows = points, normals, drawn.log_labels[0], (drawn.points - seen) * frame.scale
    together = [row.reshape(draws, -1, row.shape[2]) for row in rows]
    return [Reading(*each) for each in zip(*together, strict=True)]
