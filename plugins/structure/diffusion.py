"""The paper's way: denoise the part in the frame of a context, and see whether it fits.

With earlier candidates, the best of each structure are denoised in their own frames.  Alone, the
contexts of the surface's genus are tried in all orientations, in one batch, and ranked by a
residual: how far the part and the polycube placed on it are from each other, and how much the
faces that points land on look elsewhere than the surface does.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from polycube.diffusion.encoding import learning_frame
from polycube.geometry import rough_map
from polycube.geometry.frames import frames, rotations
from polycube.geometry.lattice import boundary, collapse, genus, lattice
from polycube.geometry.projection import project
from polycube.geometry.surface import face_areas, face_normals
from polycube.geometry.surface import genus as surface_genus
from polycube.registry import build, register
from polycube.types import Candidate, Polycube, RoughMap, TriMesh

from .reader import structure_key

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

logger = logging.getLogger(__name__)

LOOK = 0.3  # cells that a face looking square to the surface counts for in the residual


class Guess(NamedTuple):
    """A polycube and how the part is turned to it."""

    polycube: Polycube
    rotation: np.ndarray  # (3, 3) from the model to the axes of the polycube
    key: str


@register("structure", "diffusion")
@dataclass(frozen=True, kw_only=True, eq=False)
class Diffusion:
    """Propose by denoising surface samples with a trained network."""

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]  # name -> (3, 3, 3) bool
    weights: str | None = None  # safetensors file or its folder; None: the shipped ones
    sampler: Mapping[str, object] = field(default_factory=lambda: {"plugin": "ddim", "steps": 1})
    samples: int = 4  # earlier candidates denoised at most
    kept: int = 12  # candidates returned at most when nothing was proposed before
    tried: int = 48  # contexts and orientations tried at most when nothing was proposed before
    frames: int = 2  # frames tried when nothing was proposed before
    seed: int = 0

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates with their trajectories, smallest residual first.

        None when the weights do not know the grid or a primitive.
        """
        from polycube.diffusion.weights import load_denoiser  # torch is heavy

        denoiser = load_denoiser(build, self.weights)
        unknown = set(self.primitives) - set(denoiser.primitives)
        if tuple(self.grid) != denoiser.grid or unknown:
            logger.info(
                "diffusion: the weights know grid %s with %s only; nothing proposed",
                "x".join(map(str, denoiser.grid)),
                ", ".join(denoiser.primitives),
            )
            return []
        guesses = self._proposed(candidates) if candidates else self._enumerated(surface)
        found = self._denoised(denoiser, surface, guesses) if guesses else []
        found = sorted(found, key=lambda candidate: candidate.cost)[: self.kept]
        logger.info(
            "diffusion: %d structures denoised, %d kept, residual %s",
            len(guesses),
            len(found),
            ", ".join(f"{candidate.cost:.3f}" for candidate in found) or "none",
        )
        return found

    def _proposed(self, candidates: tuple[Candidate, ...]) -> list[Guess]:
        """The cheapest candidate of each structure, the best few."""
        best: dict[str, Candidate] = {}
        for candidate in sorted(candidates, key=lambda candidate: candidate.cost):
            best.setdefault(candidate.key, candidate)
        chosen = list(best.values())[: self.samples]
        return [Guess(c.polycube, _rotation(c.rough_map, c.polycube), c.key) for c in chosen]

    def _enumerated(self, surface: TriMesh) -> list[Guess]:
        """Structures of the surface's genus in all orientations, those of like shape first."""
        from polycube.diffusion.templates import contexts

        wanted = surface_genus(surface)
        polycubes = [
            collapse(lattice(self.grid, context, self.primitives))
            for context in contexts(self.grid, self.primitives)
        ]
        fitting = [p for p in polycubes if _starts_at_corner(p) and genus(p) == wanted]
        guesses = []
        for number, frame in enumerate(frames(surface, self.frames)):
            for turn in rotations():
                extent = np.ptp(surface.vertices @ (turn @ frame).T, axis=0)
                for polycube in fitting:
                    guess = Guess(polycube, turn @ frame, structure_key(polycube, turn, number))
                    guesses.append((np.log(extent / _extent(polycube)).std(), guess))
        distinct: dict[str, Guess] = {}
        for _, guess in sorted(guesses, key=lambda pair: pair[0]):
            distinct.setdefault(guess.key, guess)
        return list(distinct.values())[: self.tried]

    def _denoised(
        self, denoiser: Denoiser, surface: TriMesh, guesses: list[Guess]
    ) -> list[Candidate]:
        """A candidate of every guess; those with equally many sample points in one batch."""
        from polycube.diffusion.process import kept_steps

        sampler = build("sampler", self.sampler)
        found = []
        counts = [denoiser.n_points(guess.polycube.context) for guess in guesses]
        for count in sorted(set(counts)):
            batch = [g for g, n in zip(guesses, counts, strict=True) if n == count]
            points, normals = _sample(surface, count, np.random.default_rng(self.seed))
            placed = [learning_frame(surface.vertices, g.rotation).apply(points) for g in batch]
            contexts = [guess.polycube.context for guess in batch]
            _, trajectory = denoiser.denoise(np.stack(placed), contexts, sampler, self.seed)
            states = trajectory.transpose(1, 0, 2, 3)  # (B, S, N, 3)
            found += [_candidate(g, points, normals, s) for g, s in zip(batch, states, strict=True)]
        steps = tuple(kept_steps(denoiser.process.steps))
        return [replace(candidate, steps=steps) for candidate in found]


def _candidate(
    guess: Guess, points: np.ndarray, normals: np.ndarray, trajectory: np.ndarray
) -> Candidate:
    """Candidate from (N, 3) points of the model and their way (S, N, 3) to the polycube."""
    x_0 = trajectory[-1].astype(np.float64)
    regular, axis = project(guess.polycube, x_0)
    fitted = rough_map.fit(regular, points, guess.polycube)
    residual = _gap(guess.polycube, fitted, regular, points)
    outward = np.concatenate([np.eye(3), -np.eye(3)])[axis % 2 * 3 + axis // 2]  # (N, 3)
    residual += LOOK * (1 - (outward * (normals @ guess.rotation.T)).sum(axis=1).mean())
    return Candidate("diffusion", guess.polycube, fitted, residual, guess.key, trajectory)


def _gap(polycube: Polycube, fitted: RoughMap, regular: np.ndarray, points: np.ndarray) -> float:
    """Mean distance from the part to the placed polycube and back, in cells."""
    faces = boundary(polycube)
    surface = TriMesh(faces.vertices, faces.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    everywhere, _ = _sample(surface, len(points), np.random.default_rng(0))
    there = np.linalg.norm(rough_map.evaluate(fitted, regular) - points, axis=1).mean()
    back = cKDTree(points).query(rough_map.evaluate(fitted, everywhere))[0].mean()
    cell = np.linalg.norm(np.ptp(points, axis=0)) / np.linalg.norm(_extent(polycube))
    return float((there + back) / cell)


def _rotation(rough: RoughMap, polycube: Polycube) -> np.ndarray:
    """Rotation (3, 3) from the model to the polycube: of the map's best affine fit."""
    corners = np.stack(np.meshgrid(rough.x, rough.y, rough.z, indexing="ij"), axis=-1)
    corners = corners.reshape(-1, 3) - corners.reshape(-1, 3).mean(axis=0)
    linear = np.linalg.lstsq(corners, rough.positions.reshape(-1, 3), rcond=None)[0].T
    left, _, right = np.linalg.svd(linear)
    proper = left * [1, 1, np.sign(np.linalg.det(left @ right))] @ right
    return proper.T


def _extent(polycube: Polycube) -> np.ndarray:
    """(3,) size of the solid, in cells."""
    return np.array([knots[-1] - knots[0] for knots in polycube.knots])


def _starts_at_corner(polycube: Polycube) -> bool:
    """Whether the solid touches the grid's three lower faces: others are the same, moved."""
    return all(knots[0] == 0 for knots in polycube.knots)


def _sample(
    surface: TriMesh, n_points: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Random points (N, 3) of the surface, uniform by area, and its normals (N, 3) there."""
    area = face_areas(surface).cumsum()
    face = np.searchsorted(area, rng.uniform(0, area[-1], n_points))
    root, v = np.sqrt(rng.random(n_points)), rng.random(n_points)
    weights = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    points = np.einsum("nk,nkd->nd", weights, surface.vertices[surface.faces[face]])
    return points, face_normals(surface)[face]
