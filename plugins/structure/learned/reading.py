"""Draws of a network at sample points of a part, interpolated to its triangles and vertices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.any_structure import OUTWARD
from polycube.registry import build
from polycube.surface.frames import rotations
from polycube.surface.measures import face_areas, face_normals
from polycube.types import TriMesh

from .hypotheses import sample

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

NEAR = 4  # number of sample points that are averaged for a triangle
LOOK = 0.2  # distance that is added between points with opposite normals
READ = 0.2  # time, as a share of the steps, at which the labels of a draw are read


class Reading(NamedTuple):
    """One draw of the network for a surface."""

    log_axis: np.ndarray  # (F, 6) log-probabilities of types.AXES for each triangle
    places: np.ndarray  # (V, 3) of the vertices on the polycube, in the frame of the surface


@dataclass(frozen=True, eq=False)
class Cloud:
    """One draw at sample points, in the frame of the surface."""

    points: np.ndarray  # (N, 3)
    normals: np.ndarray  # (N, 3)
    log_axis: np.ndarray  # (N, 6) log-probabilities of the axes of types.AXES
    moved: np.ndarray  # (N, 3) from the points to their places on the polycube

    def read(self, surface: TriMesh) -> Reading:
        """Interpolate: a triangle has the mean of nearby points, a vertex that of its triangles."""
        near = self._near(surface)
        weight = np.repeat(face_areas(surface), 3)
        moved = np.repeat(self.moved[near].mean(axis=1), 3, axis=0)
        number = len(surface.vertices)
        total = np.bincount(surface.faces.ravel(), weight, number)
        sums = [np.bincount(surface.faces.ravel(), weight * m, number) for m in moved.T]
        mean = np.transpose(sums) / np.maximum(total, 1e-30)[:, None]
        return Reading(self.log_axis[near].mean(axis=1), surface.vertices + mean)

    def _near(self, surface: TriMesh) -> np.ndarray:
        """(F, NEAR) indices of points near the triangles, preferably on the same side of a wall."""
        middle = surface.vertices[surface.faces].mean(axis=1)
        there = np.hstack([middle, LOOK / 2 * face_normals(surface)])
        tree = cKDTree(np.hstack([self.points, LOOK / 2 * self.normals]))
        return tree.query(there, k=NEAR)[1]


def readings(
    denoiser: Denoiser,
    surface: TriMesh,
    genus: int,
    sampler: Mapping[str, object],
    draws: int,
    clouds: int,
    passes: int,
    seed: int,
) -> list[Reading]:
    """Draws for a surface in a frame.

    Each draw has the surface in a random one of the 24 orientations of its axes, so that the result
    does not depend on the orientation of the part.

    Parameters
    ----------
    draws
        Number of draws.
    clouds
        Number of sets of sample points in each draw.
    passes
        Largest number of passes of the network. Two draws have one pass, the next two have two, and
        so on. The input of a further pass is the surface as moved by the pass before.
    """
    rng = np.random.default_rng(seed)
    turns = rotations()[rng.integers(24, size=draws)]
    shown, read = [surface] * draws, [Reading(np.empty((0, 6)), surface.vertices)] * draws
    for done in range(passes):
        going = [k for k in range(draws) if k // 2 % passes >= done]
        turned = [(shown[k], turns[k]) for k in going]
        drawn = _clouds(denoiser, turned, genus, sampler, clouds, rng)
        for k, cloud in zip(going, drawn, strict=True):
            read[k] = cloud.read(shown[k])
            shown[k] = TriMesh(read[k].places, surface.faces)
    return read


def _clouds(
    denoiser: Denoiser,
    turned: Sequence[tuple[TriMesh, np.ndarray]],
    genus: int,
    sampler: Mapping[str, object],
    clouds: int,
    rng: np.random.Generator,
) -> list[Cloud]:
    """A draw for each surface in its orientation, at the points of all its clouds."""
    n_points, number = denoiser.n_points(genus), clouds * len(turned)
    sampled = [sample(each, n_points, rng) for each, _ in turned for _ in range(clouds)]
    points, normals = (np.stack(rows) for rows in zip(*sampled, strict=True))
    frames = [learning_frame(each.vertices, r) for each, r in turned for _ in range(clouds)]
    seen = np.stack([frame.apply(p) for frame, p in zip(frames, points, strict=True)])
    said = denoiser.denoise(
        seen,
        np.stack([n @ frame.rotation.T for frame, n in zip(frames, normals, strict=True)]),
        [genus] * number,
        build("sampler", sampler),
        int(rng.integers(2**31)),
        read=READ,
    )
    places = np.stack([frame.invert(p) for frame, p in zip(frames, said.points, strict=True)])
    seen_as = np.stack(
        [(OUTWARD @ frame.rotation.T @ OUTWARD.T).argmax(axis=1) for frame in frames]
    )
    log_axis = np.take_along_axis(said.log_labels[0], seen_as[:, None], axis=2)
    rows = points, normals, log_axis, places - points
    together = [row.reshape(len(turned), -1, row.shape[2]) for row in rows]
    return [Cloud(*each) for each in zip(*together, strict=True)]
