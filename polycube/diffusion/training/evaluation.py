"""Distance of sampled points from the truth, on pairs that are not in the training set.

Each pair gives columns of numbers; columns without a prediction are omitted. The polycube face of a
point is determined in two ways: the closest face, and the closest face with the labels of the
network taken into account (`structure.projection`). Distances are in cells.
"""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from polycube.diffusion.denoiser import Denoiser, Sampler
from polycube.diffusion.pairs.pairs import Pair, Pairs, Points
from polycube.diffusion.pairs.templates import Context, turned_contexts
from polycube.diffusion.process import DiffusionProcess, Predict
from polycube.structure.lattice import (
    OUTWARD,
    Boundary,
    boundary,
    cell_and_wall,
    collapse,
    genus,
    lattice,
)
from polycube.structure.projection import TRUST, log_probability, project_onto
from polycube.surface.frames import rotations
from polycube.types import Polycube

Columns = dict[str, np.ndarray]  # (N,) for the points of a pair, or (1,) for the pair
Primitives = Mapping[str, np.ndarray]  # name -> (3, 3, 3) bool

NORMAL_95 = 1.96  # half of the 95 % interval of a normal distribution, in standard deviations
TIMED = 3  # number of pairs that are also sampled one by one, to measure the time
LOOK = 0.3  # cells equivalent to a face perpendicular to the surface


def evaluate(
    denoiser: Denoiser,
    pairs: Pairs,
    n_pairs: int,
    primitives: Primitives,
    sampler: Sampler,
    batch_size: int,
    seed: int = 0,
) -> tuple[list[Pair], list[Columns]]:
    """The first pairs of a stream and the columns of each.

    error, error_one_step : distance of x_0 and of the first prediction from the truth, in cells
    error_untouched, patch_untouched etc. : the same of each baseline, see `baselines`
    off_polycube : distance of x_0 from the polycube
    patch, cell, wall : whether the closest face is in the correct patch and cell, and correctly a
        hole's or an outer one; labelled_patch etc.: with the labels of the network
    context_top1, _top3 : whether the classifier ranks the correct shape first, or among the first
        three, of those with its genus; context_top1_any_genus; turned_*: for a random rotation
        after which a context has the shape
    seconds_in_batch, seconds : time of sampling, per pair
    """
    made = [pairs(index) for index in range(n_pairs)]
    columns: list[Columns] = [{} for _ in made]
    polycubes = {c: lattice(pairs.grid, c, primitives) for c in {p.context for p in made}}
    for batch in _batches(made, batch_size):
        chosen = [made[i] for i in batch]
        samples = zip(batch, chosen, sampled(denoiser, chosen, sampler, seed), strict=True)
        for i, pair, (x_0, x_1, seconds, *log_labels) in samples:
            columns[i] |= point_columns(pair, polycubes[pair.context], x_0, x_1, log_labels)
            if len(batch) == batch_size:
                columns[i]["seconds_in_batch"] = seconds
    for pair, found in list(zip(made, columns, strict=True))[:TIMED]:
        began = time.perf_counter()
        denoiser.denoise(*_stacked([pair]), [pair.context], sampler, seed)
        found["seconds"] = np.array([time.perf_counter() - began])
    if denoiser.options.classifier:
        every = _context_columns(denoiser, pairs, made, primitives, batch_size)
        for found, ranks in zip(columns, every, strict=True):
            found |= ranks
    return made, columns


def sampled(
    denoiser: Denoiser, pairs: Sequence[Points], sampler: Sampler, seed: int
) -> list[tuple[np.ndarray, ...]]:
    """Of each pair x_0 (N, 3), the first prediction (N, 3), the time (1,), and the log-labels."""
    given = *_stacked(pairs), [denoiser.condition.value_of(pair) for pair in pairs]
    began = time.perf_counter()
    found = denoiser.denoise(*given, sampler, seed)
    seconds = np.full((len(pairs), 1), (time.perf_counter() - began) / len(pairs))
    first = denoiser.denoise(*given, one_step, seed).points
    return list(zip(found.points, first, seconds, *found.log_labels, strict=True))


def summary(columns: Sequence[Columns]) -> dict[str, float]:
    """Means over pairs of their means; error_p95, the 95th percentile of all points; speed.

    error_interval, labelled_patch_interval etc. : half the width of the 95 % confidence interval of
    the mean, from the spread over the pairs
    """
    values = defaultdict(list)
    for found in columns:
        for name, numbers in found.items():
            values[name].append(numbers)
    own = {name: np.array([v.mean() for v in all_]) for name, all_ in values.items()}
    means = {name: float(mean.mean()) for name, mean in own.items()}
    for name, mean in own.items():
        if len(mean) > 1 and not name.startswith("seconds"):
            means[f"{name}_interval"] = float(NORMAL_95 * mean.std(ddof=1) / len(mean) ** 0.5)
    if "error" in values:
        means["error_p95"] = float(np.percentile(np.concatenate(values["error"]), 95))
    if "seconds_in_batch" in means:
        means["samples_per_second"] = 1 / means.pop("seconds_in_batch")
    return means


def by_context(made: Sequence[Pair], columns: Sequence[Columns]) -> dict[Context, dict[str, float]]:
    """`summary` of the pairs of each context."""
    groups: dict[Context, list[Columns]] = defaultdict(list)
    for pair, found in sorted(
        zip(made, columns, strict=True), key=lambda each: str(each[0].context)
    ):
        groups[pair.context].append(found)
    return {context: summary(group) for context, group in groups.items()}


def point_columns(
    pair: Pair,
    polycube: Polycube,
    x_0: np.ndarray,
    first: np.ndarray,
    log_labels: Sequence[np.ndarray],
) -> Columns:
    """Columns of the points of one pair; x_0, first : (N, 3), origin at the corner of the grid.

    polycube : with all knots of `lattice`; log_labels : as in `Denoised`, of this pair
    """
    surface = boundary(polycube)
    labels = np.stack([surface.axis, *cell_and_wall(polycube, surface)], axis=1)  # (Q, 3)
    other = (labels != pair.labels[:, None]).any(axis=2)  # (N, Q)
    origin = np.array(polycube.grid) / 2
    truth = pair.polycube + origin
    _, right = project_onto(surface, truth, np.where(other, np.inf, 0.0))
    placed, nearest = project_onto(surface, x_0)
    found = {"error": distances(x_0, truth), "error_one_step": distances(first, truth)}
    found["off_polycube"] = distances(x_0, placed)
    for name, (at, of) in baselines(surface, pair.geometry + origin, pair.normals).items():
        found[f"error_{name}"] = distances(at, truth)
        found[f"patch_{name}"] = surface.patch[of] == surface.patch[right]
    faces = {"": nearest}
    if len(log_labels):
        cost = -TRUST * log_probability(polycube, surface, log_labels)
        faces["labelled_"] = project_onto(surface, x_0, cost)[1]
    kinds = {"patch": surface.patch, "cell": labels[:, 1], "wall": labels[:, 2]}
    for prefix, face in faces.items():
        found |= {prefix + kind: of[face] == of[right] for kind, of in kinds.items()}
    return found


def one_step(
    predict: Predict, x_T: Tensor, process: DiffusionProcess, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Sampler that returns the first prediction of x_0: plain regression."""
    x_0 = predict(x_T, process.steps)
    return x_0, torch.stack([x_T, x_0])


def threads() -> int:
    """Number of threads of a network."""
    return torch.get_num_threads()


def _context_columns(
    denoiser: Denoiser, pairs: Pairs, made: Sequence[Pair], primitives: Primitives, batch_size: int
) -> list[Columns]:
    """Rank of the correct shape among those of the classifier, for each pair."""
    turned = turned_contexts(pairs.contexts, pairs.grid, primitives)  # (C, 24, cells)
    shapes, number = np.unique(turned.reshape(-1, turned.shape[2]), axis=0, return_inverse=True)
    number = number.reshape(turned.shape[:2])  # (C, 24) numbers of the shapes
    shapes_with_context = np.flatnonzero(shapes[:, 0] >= 0)
    names = (*primitives, None)
    canonical = [tuple(names[cell] for cell in shapes[shape]) for shape in shapes_with_context]
    handles = np.array([genus(collapse(lattice(pairs.grid, c, primitives))) for c in canonical])
    rows = [pairs.contexts.index(pair.context) for pair in made]
    turns = {"context": np.zeros(len(made), int), "turned": np.zeros(len(made), int)}
    rng = np.random.default_rng(pairs.seed)
    turns["turned"] += [rng.choice(np.flatnonzero(turned[row, :, 0] >= 0)) for row in rows]
    found: list[Columns] = [{} for _ in made]
    for batch in _batches(made, batch_size):
        points, normals = _stacked([made[i] for i in batch])
        for name, turn in turns.items():
            rotation = rotations()[turn[batch]].transpose(0, 2, 1)  # (B, 3, 3)
            log_cells, log_aligned = denoiser.log_cells(points @ rotation, normals @ rotation)
            each = log_cells[:, np.arange(shapes.shape[1]), shapes[shapes_with_context]]
            for i, log_p in zip(batch, each.sum(axis=2) + log_aligned[:, None], strict=True):
                right = int(np.flatnonzero(shapes_with_context == number[rows[i], turn[i]])[0])
                ahead = log_p >= log_p[right]
                rank = (ahead & (handles == handles[right])).sum() - 1
                top = {"top1": rank < 1, "top3": rank < 3, "top1_any_genus": ahead.sum() == 1}
                found[i] |= {f"{name}_{end}": np.array([is_top]) for end, is_top in top.items()}
    return found


def _batches(made: Sequence[Pair], size: int) -> Iterator[list[int]]:
    """Numbers of pairs with equal numbers of points, at most `size` together."""
    groups = defaultdict(list)
    for i, pair in enumerate(made):
        groups[len(pair.geometry)].append(i)
    for group in groups.values():
        yield from (group[i : i + size] for i in range(0, len(group), size))


def _stacked(made: Sequence[Points]) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals (B, N, 3)."""
    return np.stack([p.geometry for p in made]), np.stack([p.normals for p in made])


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) distances of points (N, 3) from others."""
    return np.linalg.norm(a - b, axis=1)


def baselines(
    surface: Boundary, geometry: np.ndarray, normals: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Positions (N, 3) and faces (N,) of each baseline, by its name.

    untouched: the geometry itself, and the nearest faces; box: the geometry with its box on that of
    the polycube; normals: this on the nearest faces that look the same way; centre: one point for
    all, the centre of the polycube.

    surface : boundary of the polycube; geometry, normals : (N, 3) in its coordinates
    """
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    boxed = low + (geometry - geometry.min(axis=0)) / np.ptp(geometry, axis=0) * (high - low)
    away = LOOK * (1 - normals @ OUTWARD[surface.axis].T)  # (N, Q)
    middle = np.broadcast_to((low + high) / 2, geometry.shape)
    return {
        "untouched": (geometry, project_onto(surface, geometry)[1]),
        "box": (boxed, project_onto(surface, boxed)[1]),
        "normals": project_onto(surface, boxed, away),
        "centre": (middle, project_onto(surface, middle)[1]),
    }
