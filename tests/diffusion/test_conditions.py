"""Conditions of a denoiser: contexts of a grid, or the genus of any structure."""

import numpy as np
import pytest

from polycube.diffusion.conditions import AnyStructure, GridContexts, condition
from polycube.diffusion.pairs.any_structure import UNKNOWN_GENUS, LatticePairs
from polycube.structure.lattice import genus

PAPERS = GridContexts((2, 1, 1), ("cube", "hole_z", "hole_x", "hole_y"))


def test_the_vector_of_a_grid_is_the_context_vector() -> None:
    of_grid = condition([2, 1, 1], ["cube", {"plugin": "hole_z"}])
    assert isinstance(of_grid, GridContexts) and of_grid.primitives == ("cube", "hole_z")
    assert dict(of_grid.labels) == {"axis": 6, "cell": 2, "wall": 2}
    assert (of_grid.image, of_grid.length, of_grid.origin.tolist()) == ((32, 32), 13, [1, 0.5, 0.5])
    assert np.flatnonzero(of_grid.vector(("cube", "hole_z"))).tolist() == [0, 12]


def test_the_vector_of_any_structure_marks_its_genus_or_that_it_is_unknown() -> None:
    of_any = condition(None, [])
    assert isinstance(of_any, AnyStructure) and of_any.grid == ()
    for genus_, one in ((0, 0), (8, 8), (None, 9), (9, 9), (-1, 9)):
        vector = of_any.vector(genus_)
        assert vector.dtype == np.float32 and vector.sum() == 1 == vector[one]


def test_labels_of_pairs_are_classes_and_the_genus_is_that_of_the_solid() -> None:
    of_any, pairs = AnyStructure(), [LatticePairs(0, 64)(i) for i in range(60)]
    highest = np.max([pair.labels.max(axis=0) for pair in pairs], axis=0)
    assert (highest < list(of_any.labels.values())).all()
    assert highest.tolist() == [5, 6]  # all classes occur
    with_genus = [pair for pair in pairs if pair.genus is not None]
    assert all(pair.genus == genus(pair.solid) == of_any.value_of(pair) for pair in with_genus)
    assert 0 < len(pairs) - len(with_genus) < 5 * UNKNOWN_GENUS * len(pairs)


def test_a_primitive_that_was_not_trained_is_refused() -> None:
    with pytest.raises(LookupError, match="no primitive named 'cone'"):
        condition([1, 1, 1], ["cube"]).vector(("cone",))


@pytest.mark.parametrize(
    ("context", "positions"),
    [
        (("cube", None), [0]),
        ((None, "cube"), [4]),
        (("hole_z", None), [8]),
        ((None, "hole_y"), [28]),
        (("cube", "cube"), [0, 4]),  # the paper's ninth type
        (("hole_x", "hole_z"), [12, 16]),
    ],
)
def test_context_vector_of_the_paper(context: tuple, positions: list) -> None:
    vector = PAPERS.vector(context)
    assert len(vector) == 29 == PAPERS.length
    assert np.flatnonzero(vector).tolist() == positions


def test_wrong_contexts_are_refused() -> None:
    with pytest.raises(LookupError, match="no primitive named 'cone'; have cube"):
        PAPERS.vector(("cone", None))
    with pytest.raises(ValueError, match="must name 2 cells"):
        PAPERS.vector(("cube",))
