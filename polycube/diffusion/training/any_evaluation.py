"""Accuracy for arbitrary structures, on pairs that are not in the training set.

Distances are in units of the learning frame, in which the longest edge of a part is 2.
"""

import time
from collections.abc import Callable

import numpy as np

from polycube.diffusion.denoiser import Denoiser, Sampler
from polycube.diffusion.pairs.any_structure import LatticePair
from polycube.diffusion.training.evaluation import Columns, one_step


def evaluate_any(
    denoiser: Denoiser,
    pairs: Callable[[int], LatticePair],
    n_pairs: int,
    sampler: Sampler,
    batch_size: int,
    seed: int = 0,
) -> list[Columns]:
    """Columns of the first pairs of a stream.

    error, error_one_step, error_untouched : distance of x_0, of the first prediction and of the
        geometry from the truth
    labelled_axis, labelled_knot : whether the most probable label is correct
    nearest_axis : whether the axis closest to the normal is correct, which needs no network
    seconds_in_batch : time of sampling, per pair
    """
    columns: list[Columns] = []
    for first in range(0, n_pairs, batch_size):
        made = [pairs(index) for index in range(first, min(first + batch_size, n_pairs))]
        points, normals = (np.stack([getattr(p, n) for p in made]) for n in ("geometry", "normals"))
        genera = [pair.genus for pair in made]
        began = time.perf_counter()
        denoised = denoiser.denoise(points, normals, genera, sampler, seed)
        each = (time.perf_counter() - began) / len(made)
        direct = denoiser.denoise(points, normals, genera, one_step, seed).points
        for k, pair in enumerate(made):
            labels = [log_p[k].argmax(axis=1) for log_p in denoised.log_labels]
            columns.append(
                {
                    "error": _distance(denoised.points[k], pair.polycube),
                    "error_one_step": _distance(direct[k], pair.polycube),
                    "error_untouched": _distance(pair.geometry, pair.polycube),
                    "nearest_axis": nearest_axis(pair.normals) == pair.labels[:, 0],
                    "seconds_in_batch": np.array([each]),
                }
            )
            for i, name in enumerate(denoiser.condition.labels if labels else ()):
                columns[-1][f"labelled_{name}"] = labels[i] == pair.labels[:, i]
    return columns


def nearest_axis(normals: np.ndarray) -> np.ndarray:
    """(N,) 0..5, the direction of types.AXES closest to each normal (N, 3)."""
    axis = np.abs(normals).argmax(axis=1)
    return 2 * axis + (normals[np.arange(len(axis)), axis] < 0)


def _distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a - b, axis=1)
