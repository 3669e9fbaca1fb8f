"""Probable structures according to a trained classifier, in all orientations of a few frames.

The classifier receives the points of the part in every orientation. For each orientation it
predicts the primitive of each cell of the grid, and whether the part is aligned with the grid. The
guesses are the most probable contexts that are solids with the genus of the part. A structure can
have contexts in several orientations, a box in all 24; the mean over them is more reliable than a
single one.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.pairs import sample as sample_faces
from polycube.registry import build
from polycube.structure.lattice import collapse, genus, is_manifold, lattice
from polycube.surface.frames import frames, rotations
from polycube.surface.measures import face_normals
from polycube.surface.measures import genus as surface_genus
from polycube.types import Polycube, TriMesh

from ..slices.candidates import structure_key

if TYPE_CHECKING:
    from polycube.diffusion.denoiser import Denoiser

logger = logging.getLogger(__name__)

UNLIKELY = 0.07  # cost of a structure with a probability lower by a factor e
OTHER_KIND = "the weights %s are for %s; proposals %s use the included weights"
FILLINGS = 64  # number of the most probable contexts considered in each orientation


@dataclass(frozen=True, eq=False)
class Guess:
    """A structure in a frame, in the proportions of one of its contexts."""

    polycube: Polycube  # collapsed
    rotation: np.ndarray  # (3, 3) from the model to the axes of the polycube
    key: str
    log_likelihood: float  # of the structure: mean over the orientations in which it has a context
    probability: float | None  # of the structure among all of its genus in the frame

    def box(self, surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
        """Linear map (3, 3) and offset (3,) from the box of the polycube to that of the part."""
        turned = surface.vertices @ self.rotation.T
        low, high = np.transpose([knots[[0, -1]] for knots in self.polycube.knots])
        scale = np.ptp(turned, axis=0) / (high - low)
        return self.rotation.T * scale, self.rotation.T @ (turned.min(axis=0) - scale * low)


def denoiser_of_grid(
    weights: str | None, grid: tuple[int, int, int], primitives: Mapping[str, np.ndarray]
) -> Denoiser | None:
    """The trained network of a grid; raises InputError.

    The included weights of the grid are used if none are given, or if those given are for any
    structure. None if there are none, or if the network has another grid or other primitives.
    """
    # torch takes long to import
    from polycube.diffusion.weights import load_denoiser, shipped_grids

    if weights is None and tuple(grid) not in shipped_grids():
        shape = "x".join(map(str, grid))
        logger.info("no weights are included for grid %s; nothing is proposed", shape)
        return None
    denoiser = load_denoiser(build, weights, grid)
    if not denoiser.condition.grid:
        logger.warning(OTHER_KIND, weights, "any structure, not a grid", "of a grid")
        return denoiser_of_grid(None, grid, primitives)
    if tuple(grid) == denoiser.condition.grid and set(primitives) <= set(
        denoiser.condition.primitives
    ):
        return denoiser
    level = logging.INFO if weights is None else logging.WARNING
    by, names = f" by {weights}" if weights else "", ", ".join(denoiser.condition.primitives)
    wanted, known = ("x".join(map(str, each)) for each in (grid, denoiser.condition.grid))
    message = "nothing proposed%s on grid %s: the weights are for grid %s with %s only"
    logger.log(level, message, by, wanted, known, names)
    return None


def denoiser_of_any(weights: str | None) -> Denoiser:
    """The trained network of any structure; raises InputError.

    The included weights are used if none are given, or if those given are for a grid.
    """
    from polycube.diffusion.weights import load_denoiser  # torch takes long to import

    denoiser = load_denoiser(build, weights, ())
    if not denoiser.condition.grid:
        return denoiser
    logger.warning(OTHER_KIND, weights, "a grid, not any structure", "of any structure")
    return denoiser_of_any(None)


def guesses(
    denoiser: Denoiser,
    surface: TriMesh,
    primitives: Mapping[str, np.ndarray],
    n_frames: int,
    seed: int,
) -> list[Guess]:
    """Structures with the genus of the surface, most probable first, each in all proportions.

    The proportions closest to those of the part come first. Without a classifier all structures
    have equal probability. Of contexts that give the same solid in the same place, such as hole_y
    and hole_z a quarter turn apart, the most probable one is used.
    """
    solid = _solids(denoiser, primitives, surface_genus(surface))
    turns = rotations()
    placed = [turn @ frame for frame in frames(surface)[:n_frames] for turn in turns]
    # most probable context of a rotation
    log_ps: dict[tuple[int, str], dict[int, float]] = defaultdict(dict)
    best: dict[tuple[int, str, str], tuple[float, int, Polycube]] = {}  # and of each solid
    for index, filling, log_p in _fillings(denoiser, surface, placed, seed):
        if polycube := solid(filling):
            frame, turn = divmod(index, len(turns))
            key = structure_key(polycube, turns[turn], frame)
            log_ps[frame, key].setdefault(turn, log_p)
            entry = log_p, index, polycube
            view = turns[turn]  # frame to polycube
            axes = zip(np.abs(view).argmax(axis=0), view.sum(axis=0).astype(int), strict=True)
            widths = np.concatenate([np.diff(polycube.knots[k])[::sign] for k, sign in axes])
            solid_key = frame, key, " ".join(f"{width:.3f}" for width in widths)
            best[solid_key] = max(entry, best.get(solid_key, entry), key=lambda entry: entry[0])
    mean = {structure: float(np.mean([*each.values()])) for structure, each in log_ps.items()}
    total: dict[int, float] = defaultdict(float)  # of the probabilities in a frame
    for (frame, _), log_p in mean.items():
        total[frame] += np.exp(log_p)
    found = []
    for (frame, key, _), (_, index, polycube) in best.items():
        extent = np.ptp(surface.vertices @ placed[index].T, axis=0)
        stretched = np.log(extent / [knots[-1] - knots[0] for knots in polycube.knots]).std()
        log_p = mean[frame, key]
        guess = Guess(polycube, placed[index], key, log_p, float(np.exp(log_p) / total[frame]))
        found.append((-log_p, key, stretched, guess))
    return [guess for *_, guess in sorted(found, key=lambda row: row[:3])]


def _solids(
    denoiser: Denoiser, primitives: Mapping[str, np.ndarray], wanted: int
) -> Callable[[tuple[int, ...]], Polycube | None]:
    """The solid of a context; None if it has another genus or does not start at the corner."""
    names = (*denoiser.condition.primitives, None)

    @cache
    def solid(filling: tuple[int, ...]) -> Polycube | None:
        context = tuple(names[number] for number in filling)
        if not any(context) or not set(context) <= {*primitives, None}:
            return None
        polycube = collapse(lattice(denoiser.condition.grid, context, primitives))
        # others are translations of the same solid
        at_corner = all(knots[0] == 0 for knots in polycube.knots)
        fits = at_corner and genus(polycube) == wanted and is_manifold(polycube)
        return polycube if fits else None

    return solid


def _fillings(
    denoiser: Denoiser, surface: TriMesh, placed: list[np.ndarray], seed: int
) -> Iterator[tuple[int, tuple[int, ...], float]]:
    """Orientation, context as numbers of primitives, log-probability; most probable first."""
    n_points = int(np.prod(denoiser.condition.image))
    points, normals = sample(surface, n_points, np.random.default_rng(seed))
    normalised = np.stack([learning_frame(surface.vertices, r).apply(points) for r in placed])
    turned = np.stack([normals @ r.T for r in placed])
    if denoiser.options.classifier:
        log_cells, log_aligned = denoiser.log_cells(normalised, turned)
    else:
        n_cells = int(np.prod(denoiser.condition.grid))
        log_cells = np.zeros((len(placed), n_cells, len(denoiser.condition.primitives) + 1))
        log_aligned = np.zeros(len(placed))
    cells = np.empty((len(placed), 1, 0), int)
    total = log_aligned[:, None]  # (B, K) of the K most probable contexts of the first cells
    for log_p in np.moveaxis(log_cells, 1, 0):  # (B, classes)
        longer = (total[:, :, None] + log_p[:, None]).reshape(len(placed), -1)
        best = np.argsort(-longer, axis=1, kind="stable")[:, :FILLINGS]
        before, here = np.divmod(best, log_p.shape[1])
        before = np.take_along_axis(cells, before[..., None], axis=1)
        cells = np.concatenate([before, here[..., None]], axis=2)
        total = np.take_along_axis(longer, best, axis=1)
    for index, rank in np.ndindex(total.shape):
        yield index, tuple(cells[index, rank].tolist()), float(total[index, rank])


def sample(
    surface: TriMesh, n_points: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Random points (N, 3) of the surface, uniform by area, with normals (N, 3)."""
    face, weights = sample_faces(surface.faces, surface.vertices, n_points, rng)
    points = np.einsum("nk,nkd->nd", weights, surface.vertices[surface.faces[face]])
    return points, face_normals(surface)[face]
