"""Lattices that are right, wrong or missing have the measures that follow."""

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import LatticePairs
from polycube.diffusion.training.any_evaluation import evaluate_lattices, overlap
from polycube.diffusion.training.evaluation import summary
from polycube.errors import InputError
from polycube.surface.measures import diagonal
from polycube.types import Polycube, TriMesh

PAIRS = LatticePairs(0, 0)


def solid(full: list, *knots: list[float]) -> Polycube:
    return Polycube(np.array(full, bool), *knots, (1, 1, 1), ("lattice",))


def test_overlap_of_boxes_is_exact() -> None:
    """Two boxes of volume 6, shifted by a third along x: 4 of 8; scaled by 2 they are apart."""
    one = solid([[[1]]], [0, 3], [0, 2], [0, 1])
    other = solid([[[1]]], [1, 4], [0, 2], [0, 1])
    assert overlap(one, other, 1) == pytest.approx(4 / 8)
    assert overlap(one, one, 2) == pytest.approx(6 / 48)
    ell = solid([[[1], [1]], [[1], [0]]], [0, 1, 3], [0, 1, 2], [0, 1])
    assert overlap(ell, one, 1) == pytest.approx(4 / 6)


def test_the_best_of_the_first_draws_counts() -> None:
    """Nothing, then a box instead of the solid, then the truth; four draws in all."""
    parts = iter([PAIRS.part(number) for number in (2, 3)])

    def draw(surface: TriMesh, genus: int) -> list[Polycube | None]:
        part = next(parts)
        size = diagonal(TriMesh(part.geometry, part.surface.faces))
        x, y, z = (knots / size for knots in part.polycube.knots)
        assert diagonal(surface) == pytest.approx(1) and genus == part.genus
        box = solid([[[1]]], x[[0, -1]], y[[0, -1]], z[[0, -1]])
        truth = Polycube(part.polycube.occupancy, x, y, z, (1, 1, 1), ("lattice",))
        return [None, box, truth, truth]

    found = summary(evaluate_lattices(draw, _Stream((2, 3)), 2))
    assert (found["lattice_1"], found["lattice_4"]) == (0, 1) and "lattice_16" not in found
    assert found["volume_1"] == 0 and found["volume_4"] == pytest.approx(1)
    genera = [PAIRS.part(number).genus for number in (2, 3)]
    styles = {PAIRS.part(number).style for number in (2, 3)}
    assert all(found[f"lattice_4_{style}"] == 1 for style in styles)
    assert found["genus_any"] == 1 and found["genus"] == pytest.approx(
        np.mean([(2 + (g == 0)) / 4 for g in genera])
    )


def test_parts_of_the_wanted_number_of_slabs_are_taken() -> None:
    surfaces = []

    def draw(surface: TriMesh, genus: int) -> list[Polycube | None]:
        surfaces.append(surface)
        return [None]

    evaluate_lattices(draw, PAIRS, 3, (2, 4))
    shapes = [PAIRS.part(number).polycube.occupancy.shape for number in range(40)]
    chosen = [n for n, shape in enumerate(shapes) if 2 <= min(shape) and max(shape) <= 4][:3]
    parts = [PAIRS.part(number) for number in chosen]
    assert [len(s.faces) for s in surfaces] == [len(part.surface.faces) for part in parts]


def test_slabs_that_no_part_has_are_refused() -> None:
    with pytest.raises(InputError, match="only 0 of the first 100 parts have 7 to 9 along"):
        evaluate_lattices(lambda surface, genus: [], PAIRS, 1, (7, 9))


class _Stream:
    """Chosen parts of the stream."""

    def __init__(self, numbers: tuple[int, ...]) -> None:
        self.numbers = numbers

    def part(self, number: int) -> object:
        return PAIRS.part(self.numbers[number % 2])
