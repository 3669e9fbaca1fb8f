"""Denoise the part in the frames of guesses, and measure how well the results fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from polycube.registry import build
from polycube.structure import rough_map
from polycube.structure.lattice import OUTWARD, boundary, lattice
from polycube.structure.projection import project
from polycube.types import Candidate, Polycube, RoughMap, TriMesh

from .hypotheses import UNLIKELY, Guess, sample

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

EDGE = 0.02  # share of the points outside of each side of the box of a noisy result
SMOOTH, OUTLIER = 3e-4, 0.2  # parameters of the fit of the rough map
LOOK = 0.3  # cells in the residual equivalent to a face perpendicular to the surface


def denoised(
    denoiser: Denoiser,
    surface: TriMesh,
    batch: list[Guess],
    primitives: Mapping[str, np.ndarray],
    sampler: Mapping[str, object],
    seed: int,
    proposal: str = "diffusion",
    assigns: bool = False,
) -> list[Candidate]:
    """A candidate of every guess; those with equal numbers of sample points are batched.

    assigns : do not take the points of the result in their order, see `_assigned`
    """
    from polycube.diffusion.process import kept_steps

    steps = tuple(kept_steps(denoiser.process.steps))
    counts = np.array([len(denoiser.pixels(guess.polycube.context)) for guess in batch])
    found: dict[int, Candidate] = {}
    for count in np.unique(counts):
        rows = np.flatnonzero(counts == count).tolist()
        points, normals = sample(surface, count, np.random.default_rng(seed))
        turns = [batch[index].rotation for index in rows]
        contexts = [batch[index].polycube.context for index in rows]
        ways = zip(turns, contexts, strict=True)
        result = denoiser.denoise(
            np.stack([denoiser.frame(surface.vertices, *way).apply(points) for way in ways]),
            np.stack([normals @ turn.T for turn in turns]),
            contexts,
            build("sampler", sampler),
            seed,
        )
        for row, index in enumerate(rows):
            guess, order = batch[index], np.arange(count)
            polycube, box = guess.polycube, guess.box(surface)
            x_0 = result.points[row].astype(np.float64)
            if assigns:
                x_0 = _boxed(x_0, polycube)
                order = _assigned(points, x_0, *box)
            solid = lattice(polycube.grid, polycube.context, primitives)
            regular, axis = project(solid, x_0, [log_p[row] for log_p in result.log_labels])
            own, facing = points[order], normals[order] @ guess.rotation.T
            fitted = _fit(regular, own, polycube, *box)
            misalignment = 1 - (OUTWARD[axis] * facing).sum(axis=1).mean()
            residual = _miss(polycube, fitted, regular, own) + LOOK * misalignment
            cost, states = residual - UNLIKELY * guess.log_likelihood, result.trajectory[:, row]
            about = guess.key, states, guess.probability, steps
            found[index] = Candidate(proposal, polycube, fitted, cost, *about)
    return [found[index] for index in range(len(batch))]


def _boxed(x_0: np.ndarray, polycube: Polycube) -> np.ndarray:
    """Points (N, 3), most of which are moved into the box of the polycube, axis by axis."""
    low, high = np.quantile(x_0, [EDGE, 1 - EDGE], axis=0)
    start, end = np.transpose([knots[[0, -1]] for knots in polycube.knots])
    return start + (x_0 - low) / (high - low) * (end - start)


def _assigned(
    points: np.ndarray, x_0: np.ndarray, linear: np.ndarray, offset: np.ndarray
) -> np.ndarray:
    """(N,) number of the point of the part that each x_0 (N, 3) belongs to.

    The sum of the squared distances is the smallest one, in cells, after the map x -> linear @ x +
    offset from the polycube to the part.
    """
    cells = np.linalg.solve(linear, (points - offset).T).T
    return linear_sum_assignment(cdist(x_0, cells, "sqeuclidean"))[1]


def best_of_each(candidates: Iterable[Candidate]) -> list[Candidate]:
    """The cheapest candidate of each structure, cheapest first."""
    best: dict[str, Candidate] = {}
    for candidate in sorted(candidates, key=lambda candidate: candidate.cost):
        best.setdefault(candidate.key, candidate)
    return list(best.values())


def as_guesses(earlier: list[Candidate], probable: Sequence[Guess] = ()) -> list[Guess]:
    """Earlier candidates as guesses; with the lowest probability if their frame was not used."""
    known = {guess.key: (guess.log_likelihood, guess.probability) for guess in probable}
    lowest = min((guess.log_likelihood for guess in probable), default=0.0), None
    return [Guess(c.polycube, _rotation(c), c.key, *known.get(c.key, lowest)) for c in earlier]


def is_nearer(new: Candidate, old: Candidate, points: np.ndarray) -> bool:
    """Whether the new rough map is closer to points (N, 3) of the part than the old one."""
    distances = [
        cKDTree(points).query(placed)[0].mean() + cKDTree(placed).query(points)[0].mean()
        for placed in (_placed(c.polycube, c.rough_map, 2 * len(points)) for c in (new, old))
    ]
    return bool(distances[0] < distances[1])


def _fit(
    regular: np.ndarray,
    points: np.ndarray,
    polycube: Polycube,
    linear: np.ndarray,
    offset: np.ndarray,
) -> RoughMap:
    """Rough map from positions (N, 3) on the polycube to points of the part, fitted in cells.

    linear, offset : from the box of the polycube to that of the part, so that all sides have equal
        weight
    """
    cells = np.linalg.solve(linear, (points - offset).T).T
    fitted = rough_map.fit(regular, cells, polycube, smoothness=SMOOTH, outlier=OUTLIER)
    return replace(fitted, positions=fitted.positions @ linear.T + offset)


def _miss(polycube: Polycube, fitted: RoughMap, regular: np.ndarray, points: np.ndarray) -> float:
    """Mean distance between points of the part and their images, in both directions, in cells.

    regular : (N, 3) positions on the polycube of the points (N, 3) of the part
    """
    there = np.linalg.norm(rough_map.evaluate(fitted, regular) - points, axis=1).mean()
    back = cKDTree(points).query(_placed(polycube, fitted, len(points)))[0].mean()
    sides = [knots[-1] - knots[0] for knots in polycube.knots]
    cell = np.linalg.norm(np.ptp(points, axis=0)) / np.linalg.norm(sides)
    return float((there + back) / cell)


def _placed(polycube: Polycube, rough: RoughMap, n_points: int) -> np.ndarray:
    """Points (N, 3) on the boundary of the polycube, mapped to the part."""
    faces = boundary(polycube)
    surface = TriMesh(faces.vertices, faces.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    return rough_map.evaluate(rough, sample(surface, n_points, np.random.default_rng(0))[0])


def _rotation(candidate: Candidate) -> np.ndarray:
    """Rotation (3, 3) from the model to the polycube, of the affine fit of the rough map."""
    rough = candidate.rough_map
    corners = np.stack(np.meshgrid(rough.x, rough.y, rough.z, indexing="ij"), axis=-1)
    corners = corners.reshape(-1, 3) - corners.reshape(-1, 3).mean(axis=0)
    linear = np.linalg.lstsq(corners, rough.positions.reshape(-1, 3), rcond=None)[0].T
    left, _, right = np.linalg.svd(linear)
    return (left * [1, 1, np.sign(np.linalg.det(left @ right))] @ right).T
