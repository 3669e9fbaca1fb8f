"""Draws of a network at sample points of a part, interpolated to its triangles and vertices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from polycube.diffusion.encoding import learning_frame
from polycube.registry import build
from polycube.structure.lattice import OUTWARD
from polycube.surface.frames import rotations
from polycube.surface.measures import face_areas, face_normals
from polycube.types import TriMesh

from .hypotheses import sample

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

NEAR = 4  # number of sample points that are averaged for a triangle
LOOK = 0.2  # distance that is added between points with opposite normals
LABEL_TIME = 0.2  # time, as a share of the steps, at which the labels of a draw are evaluated


class Draw(NamedTuple):
    """One draw of the network for a surface."""

    log_axis: np.ndarray  # (F, 6) log-probabilities of types.AXES for each triangle
    places: np.ndarray  # (V, 3) of the vertices on the polycube, in the frame of the surface


class Cloud(NamedTuple):
    """One draw at sample points, in the frame of the surface."""

    points: np.ndarray  # (N, 3)
    normals: np.ndarray  # (N, 3)
    log_axis: np.ndarray  # (N, 6) log-probabilities of the axes of types.AXES
    moved: np.ndarray  # (N, 3) from the points to their places on the polycube

    def interpolated(self, surface: TriMesh) -> Draw:
        """A triangle has the mean of nearby points, a vertex that of its triangles.

        Points near a triangle are preferably on the same side of a wall.
        """
        middle = surface.vertices[surface.faces].mean(axis=1)
        there = np.hstack([middle, LOOK / 2 * face_normals(surface)])
        near = cKDTree(np.hstack([self.points, LOOK / 2 * self.normals])).query(there, k=NEAR)[1]
        corners, number = surface.faces.ravel(), len(surface.vertices)
        moved = np.repeat(self.moved[near].mean(axis=1), 3, axis=0)
        weight = np.repeat(face_areas(surface), 3)
        sums = [np.bincount(corners, weight * m, number) for m in (*moved.T, 1.0)]
        mean = np.transpose(sums[:3]) / np.maximum(sums[3], 1e-30)[:, None]
        return Draw(self.log_axis[near].mean(axis=1), surface.vertices + mean)


def draw(
    denoiser: Denoiser,
    surface: TriMesh,
    genus: int,
    sampler: Mapping[str, object],
    n_draws: int,
    n_clouds: int,
    n_passes: int,
    seed: int,
) -> list[Draw]:
    """Draws for a surface in a frame.

    Each draw has the surface in a random one of the 24 orientations of its axes, so that the result
    does not depend on the orientation of the part.

    n_clouds : number of sets of sample points in each draw
    n_passes : largest number of passes of the network; two draws have one pass, the next two have
        two, and so on; the input of a further pass is the surface as moved by the pass before
    """
    rng = np.random.default_rng(seed)
    turns = rotations()[rng.integers(24, size=n_draws)]
    inputs, draws = [surface] * n_draws, [Draw(np.empty((0, 6)), surface.vertices)] * n_draws
    for done in range(n_passes):
        numbers = [k for k in range(n_draws) if k // 2 % n_passes >= done]
        turned = [(inputs[k], turns[k]) for k in numbers]
        clouds = _clouds(denoiser, turned, genus, sampler, n_clouds, rng)
        for k, cloud in zip(numbers, clouds, strict=True):
            draws[k] = cloud.interpolated(inputs[k])
            inputs[k] = TriMesh(draws[k].places, surface.faces)
    return draws


def _clouds(
    denoiser: Denoiser,
    turned: Sequence[tuple[TriMesh, np.ndarray]],
    genus: int,
    sampler: Mapping[str, object],
    n_clouds: int,
    rng: np.random.Generator,
) -> list[Cloud]:
    """A draw for each surface in its orientation, at the points of all its clouds."""
    n_points, number = len(denoiser.pixels(genus)), n_clouds * len(turned)
    sampled = [sample(each, n_points, rng) for each, _ in turned for _ in range(n_clouds)]
    points, normals = (np.stack(rows) for rows in zip(*sampled, strict=True))
    frames = [learning_frame(each.vertices, r) for each, r in turned for _ in range(n_clouds)]
    denoised = denoiser.denoise(
        np.stack([frame.apply(p) for frame, p in zip(frames, points, strict=True)]),
        np.stack([n @ frame.rotation.T for frame, n in zip(frames, normals, strict=True)]),
        [genus] * number,
        build("sampler", sampler),
        int(rng.integers(2**31)),
        label_time=LABEL_TIME,
    )
    places = np.stack([frame.invert(p) for frame, p in zip(frames, denoised.points, strict=True)])
    ways = (OUTWARD @ frame.rotation.T @ OUTWARD.T for frame in frames)
    turned_axis = np.stack([way.argmax(axis=1) for way in ways])
    log_axis = np.take_along_axis(denoised.log_labels[0], turned_axis[:, None], axis=2)
    rows = points, normals, log_axis, places - points
    of_surface = [row.reshape(len(turned), -1, row.shape[2]) for row in rows]
    return [Cloud(*each) for each in zip(*of_surface, strict=True)]
