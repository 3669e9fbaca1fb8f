"""Equal shapes of contexts, and their shapes when turned."""

import numpy as np
import pytest

from polycube.diffusion.pairs.templates import IDENTITY, contexts, shape_key, turned_contexts
from polycube.structure.lattice import lattice
from polycube.surface.frames import rotations, turn

QUARTER = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # about z: x to y


def _spelled(cells: np.ndarray, primitives: dict) -> tuple:
    return tuple([*primitives, None][cell] for cell in cells)


def _about_z() -> int:
    return int(np.abs(rotations() - QUARTER).sum(axis=(1, 2)).argmin())


@pytest.fixture(scope="module")
def two(primitives: dict) -> tuple[list, np.ndarray]:
    every = contexts((2, 1, 1), primitives)
    return every, turned_contexts(every, (2, 1, 1), primitives)


def test_the_identity_has_the_stated_index() -> None:
    assert np.array_equal(rotations()[IDENTITY], np.eye(3))
    assert np.array_equal(rotations()[_about_z()], QUARTER)


@pytest.mark.parametrize(
    ("context", "canonical"),
    [
        (("cube", None), ("cube", "cube")),
        ((None, "cube"), ("cube", "cube")),
        (("cube", "cube"), ("cube", "cube")),
        ((None, "hole_y"), ("cube", "hole_y")),  # full, gap, full: the cube lengthens one end
        (("hole_y", "cube"), ("cube", "hole_y")),
        ((None, "hole_x"), ("hole_x", "hole_x")),  # one hole through both
        (("hole_x", "cube"), ("hole_x", "cube")),  # blind, open at the first end
    ],
)
def test_equal_shapes_have_one_canonical_context(
    context: tuple, canonical: tuple, two: tuple, primitives: dict
) -> None:
    every, turned = two
    cells = turned[every.index(context), IDENTITY]
    assert cells.dtype == np.int64
    assert _spelled(cells, primitives) == canonical
    here, there = (lattice((2, 1, 1), c, primitives) for c in (context, canonical))
    assert shape_key(here) == shape_key(there)


def test_a_hole_along_x_turned_about_z_is_one_along_y(two: tuple, primitives: dict) -> None:
    every, turned = two
    cells = turned[every.index(("hole_x", None)), _about_z()]
    assert _spelled(cells, primitives) == ("cube", "hole_y")


def test_a_turn_may_lead_out_of_the_grid(two: tuple, primitives: dict) -> None:
    every, turned = two
    assert (turned[every.index(("hole_y", "hole_z")), _about_z()] == -1).all()  # lies along y
    blind = turned[every.index(("hole_x", "cube"))]
    ways = {_spelled(cells, primitives) for cells in blind if cells[0] >= 0}
    assert ways == {("hole_x", "cube"), ("cube", "hole_x")}
    assert (blind == -1).all(axis=1).sum() == 16  # 24 turns, 4 for each of 6 directions


def test_turned_contexts_have_the_turned_shape(primitives: dict) -> None:
    """Slowly: turn all voxels of a few contexts of 2x2 and look at every context for their key."""
    grid = (2, 2, 1)
    every = contexts(grid, primitives)
    turned = turned_contexts(every, grid, primitives)
    assert turned.shape == (592, 24, 4)
    keys = [shape_key(lattice(grid, context, primitives)) for context in every]
    rng = np.random.default_rng(0)
    for number, rotation in zip(rng.integers(592, size=40), rng.integers(24, size=40), strict=True):
        solid = lattice(grid, every[number], primitives)
        boxes = turn(solid.occupancy, rotations()[rotation])
        size = tuple(n // 3 for n in boxes.shape)
        knots = [np.arange(n + 1) / 3 for n in boxes.shape]
        key = shape_key(type(solid)(boxes, *knots, size, (None,) * 4))
        same_shape = [c for c, k in zip(every, keys, strict=True) if k == key]
        if same_shape:
            wanted = min(same_shape, key=lambda context: context.count(None))
            assert _spelled(turned[number, rotation], primitives) == wanted
        else:
            assert (turned[number, rotation] == -1).all()
