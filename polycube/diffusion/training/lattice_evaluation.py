"""How many lattices are drawn rightly, on parts that were never trained on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from polycube.diffusion.pairs.any_structure import LatticePairs, Part
from polycube.diffusion.pairs.lattices import MOST_SLABS
from polycube.diffusion.training.evaluation import Columns
from polycube.errors import InputError
from polycube.structure.lattice import genus
from polycube.surface.measures import diagonal
from polycube.types import Polycube, TriMesh

SEEN = 100  # parts at most for one that has the wanted slabs
TRIES = (1, 4, 16)  # draws of which the best is taken

# (surface in the frame, of diagonal 1; genus) -> a collapsed lattice in the frame of each draw
Draw = Callable[[TriMesh, int], Sequence[Polycube | None]]


def evaluate_lattices(
    draw: Draw, pairs: LatticePairs, n_parts: int, slabs: tuple[int, int] = (1, MOST_SLABS)
) -> list[Columns]:
    """Columns of the first parts of a stream that have so many slabs along each axis.

    slabs : fewest and most; raises InputError where hardly any part has so many

    lattice_1, _4, _16 : whether one of the first draws has the full and empty boxes of the truth
    volume_1, _4, _16 : the largest share of the union of both solids that is in both
    genus : share of the draws that give a solid of the part's genus
    genus_any : whether one of them does
    lattice_16_cad and so on : lattice_16 of the parts of a style
    """
    seen = map(pairs.part, range(SEEN * n_parts))
    chosen = list(islice((part for part in seen if _has(part, slabs)), n_parts))
    if len(chosen) < n_parts:
        raise InputError(
            f"slabs: only {len(chosen)} of the first {SEEN * n_parts} parts have {slabs[0]} to "
            f"{slabs[1]} along each axis; use a wider range or fewer lattices"
        )
    return [columns(draw, part) for part in chosen]


def _has(part: Part, slabs: tuple[int, int]) -> bool:
    shape = part.polycube.occupancy.shape
    return slabs[0] <= min(shape) and max(shape) <= slabs[1]


def columns(draw: Draw, part: Part) -> Columns:
    """Those of one part."""
    surface = TriMesh(part.geometry, part.surface.faces)
    size = diagonal(surface)
    drawn = draw(TriMesh(part.geometry / size, surface.faces), part.genus)
    right = [each is not None and _same(each, part.polycube) for each in drawn]
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
    """Volume that two solids share, by the volume of their union; `scale` makes the drawn larger.

    Solids lie where they are; their boxes are cut at the knots of both.
    """
    lines = [
        np.unique(np.concatenate([scale * a, b]))
        for a, b in zip(drawn.knots, truth.knots, strict=True)
    ]
    middles = [(line[1:] + line[:-1]) / 2 for line in lines]
    volume = np.einsum("i,j,k->ijk", *(np.diff(line) for line in lines))
    one = _filled(drawn, [middle / scale for middle in middles])
    other = _filled(truth, middles)
    return float(volume[one & other].sum() / volume[one | other].sum())


def _filled(solid: Polycube, places: list[np.ndarray]) -> np.ndarray:
    """(X, Y, Z) bool: whether the points of a grid lie in a solid."""
    padded = np.pad(solid.occupancy, 1)
    index = [np.searchsorted(k, x) for k, x in zip(solid.knots, places, strict=True)]
    return padded[np.ix_(*index)]


def _same(one: Polycube, other: Polycube) -> bool:
    return np.array_equal(one.occupancy, other.occupancy)
