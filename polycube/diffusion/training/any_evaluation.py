"""Accuracy for arbitrary structures, on pairs that are not in the training set.

Distances are in units of the learning frame, in which the longest edge of a part is 2.
"""

from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from polycube.diffusion.denoiser import Denoiser, Sampler
from polycube.diffusion.pairs.any_structure import LatticePair, LatticePairs, Part
from polycube.diffusion.pairs.lattices import MOST_SLABS
from polycube.diffusion.training.evaluation import Columns, distances, sampled
from polycube.errors import InputError
from polycube.structure.lattice import genus, nearest_axis
from polycube.surface.measures import diagonal
from polycube.types import Polycube, TriMesh

SEARCHED = 100  # largest number of parts searched for one with the wanted slabs
TRIES = (1, 4, 16)  # numbers of draws of which the best is taken

# (surface in the frame, of diagonal 1; genus) -> a collapsed lattice in the frame per draw
Draw = Callable[[TriMesh, int], Sequence[Polycube | None]]


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
        samples = zip(made, sampled(denoiser, made, sampler, seed), strict=True)
        for pair, (x_0, x_1, seconds, *log_labels) in samples:
            columns.append(
                {
                    "error": distances(x_0, pair.polycube),
                    "error_one_step": distances(x_1, pair.polycube),
                    "error_untouched": distances(pair.geometry, pair.polycube),
                    "nearest_axis": nearest_axis(pair.normals) == pair.labels[:, 0],
                    "seconds_in_batch": seconds,
                }
            )
            labels = zip(denoiser.condition.labels, log_labels, pair.labels.T, strict=False)
            for name, log_p, label in labels:
                columns[-1][f"labelled_{name}"] = log_p.argmax(axis=1) == label
    return columns


def evaluate_lattices(
    draw: Draw, pairs: LatticePairs, n_parts: int, slabs: tuple[int, int] = (1, MOST_SLABS)
) -> list[Columns]:
    """Columns of the first parts of a stream with the wanted number of slabs along each axis.

    slabs : smallest and largest number; raises InputError if such parts are too rare

    lattice_1, _4, _16 : whether one of the first draws has the correct full and empty boxes
    volume_1, _4, _16 : largest ratio of the common volume of both solids to that of their union
    genus : share of the draws that are a solid with the genus of the part
    genus_any : whether any of them is
    lattice_16_cad etc. : lattice_16 of the parts of a style
    """
    made = map(pairs.part, range(SEARCHED * n_parts))
    searched = ((part, part.polycube.occupancy.shape) for part in made)
    has = (part for part, n in searched if slabs[0] <= min(n) and max(n) <= slabs[1])
    chosen = list(islice(has, n_parts))
    if len(chosen) < n_parts:
        wanted = f"{slabs[0]} to {slabs[1]} along each axis"
        what = f"only {len(chosen)} of the first {SEARCHED * n_parts} parts have {wanted}"
        raise InputError(what, "slabs", "use a wider range or fewer lattices")
    return [columns(draw, part) for part in chosen]


def columns(draw: Draw, part: Part) -> Columns:
    """Columns of one part."""
    surface = TriMesh(part.geometry, part.surface.faces)
    size = diagonal(surface)
    drawn = draw(TriMesh(part.geometry / size, surface.faces), part.genus)
    full = part.polycube.occupancy
    right = [each is not None and np.array_equal(each.occupancy, full) for each in drawn]
    shared = [0.0 if each is None else overlap(each, part.polycube, size) for each in drawn]
    handles = [each is not None and genus(each) == part.genus for each in drawn]
    found: Columns = {"genus": np.array([np.mean(handles)]), "genus_any": np.array([any(handles)])}
    for tries in TRIES:
        if tries <= len(drawn):
            found[f"lattice_{tries}"] = np.array([any(right[:tries])])
            found[f"lattice_{tries}_{part.style}"] = found[f"lattice_{tries}"]
            found[f"volume_{tries}"] = np.array([max(shared[:tries])])
    return found


def overlap(drawn: Polycube, truth: Polycube, scale: float) -> float:
    """Common volume of two solids divided by that of their union; `scale` enlarges the drawn one.

    The solids are not moved; their boxes are divided at the knots of both.
    """
    knots = zip(drawn.knots, truth.knots, strict=True)
    lines = [np.unique(np.concatenate([scale * a, b])) for a, b in knots]
    middles = [(line[1:] + line[:-1]) / 2 for line in lines]
    volume = np.einsum("i,j,k->ijk", *(np.diff(line) for line in lines))
    one = _filled(drawn, [middle / scale for middle in middles])
    other = _filled(truth, middles)
    return float(volume[one & other].sum() / volume[one | other].sum())


def _filled(solid: Polycube, places: list[np.ndarray]) -> np.ndarray:
    """(X, Y, Z) bool: whether the points of a grid are inside a solid."""
    index = [np.searchsorted(k, x) for k, x in zip(solid.knots, places, strict=True)]
    return np.pad(solid.occupancy, 1)[np.ix_(*index)]
