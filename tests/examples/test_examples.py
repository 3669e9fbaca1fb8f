"""The example parts: solids of the correct genus with regular triangles, reproducible."""

import numpy as np
import pytest

from docs.generators.examples.parts import PARTS, surface_of
from polycube.errors import InputError
from polycube.examples.parts import EXAMPLES, example
from polycube.io.surfaces import read_surface
from polycube.surface.checks import check_surface
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import face_areas, genus

GENUS = {"dice": 0, "ring": 1, "rod": 1, "lantern": 1, "eight": 2, "key": 1, "barrel": 0, "cup": 2}


def test_every_example_is_tested():
    assert set(EXAMPLES) == set(GENUS) == set(PARTS)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_solid_of_the_correct_genus(name):
    surface, warnings = read_surface(f"example:{name}")
    check_surface(surface)
    assert warnings == []
    assert genus(surface) == GENUS[name]
    assert 1000 <= len(surface.faces) <= 4200
    assert len(self_intersections(surface)) == 0


@pytest.mark.parametrize("name", EXAMPLES)
def test_triangles_are_well_shaped(name):
    surface = example(name)
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    squares = sum(((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a)))
    shape = 4 * np.sqrt(3) * face_areas(surface) / squares  # 1 where equilateral
    assert shape.min() > 0.3
    assert np.mean(shape) > 0.8


@pytest.mark.slow
def test_examples_are_reproducible():
    first, again = (surface_of("rod") for _ in range(2))
    assert (first.vertices == again.vertices).all() and (first.faces == again.faces).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", PARTS)
def test_the_files_are_what_the_generator_writes(name):
    """But for rounding, which differs between machines."""
    stored, made = example(name), surface_of(name)
    assert np.array_equal(stored.faces, made.faces)
    assert np.abs(stored.vertices - made.vertices).max() < 1e-9


def test_opposite_sides_of_the_dice_add_up_to_seven():
    points = example("dice").vertices
    for axis in range(3):
        dents = []
        for side in (-1, 1):
            near = points[(side * points[:, axis] < 19.5) & (side * points[:, axis] > 17)]
            inner = np.abs(np.delete(near, axis, axis=1)).max(axis=1) < 14.5
            cells = np.round(np.delete(near[inner], axis, axis=1) / 10.5)
            dents.append(len(np.unique(cells, axis=0)))
        assert sum(dents) == 7


def test_unknown_name_lists_the_names():
    with pytest.raises(InputError, match="no example named 'rodd'; have dice, ring, rod"):
        read_surface("example:rodd")
