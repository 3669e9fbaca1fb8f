"""Contexts of a grid and their tessellated surfaces."""

import numpy as np
import pytest

from polycube.diffusion.templates import SMOOTHING, contexts, template
from polycube.geometry.lattice import genus
from polycube.geometry.surface import genus as surface_genus
from polycube.geometry.surface import volume
from polycube.types import TriMesh


def test_the_paper_has_24_contexts(primitives: dict) -> None:
    found = contexts((2, 1, 1), primitives)
    assert len(found) == 24 == len(set(found))
    assert (None, None) not in found


def test_voids_and_pieces_are_left_out(primitives: dict) -> None:
    found = contexts((3, 1, 1), primitives)
    assert ("cube", None, "cube") not in found  # two pieces
    assert ("cube", "hole_x", "cube") not in found  # the hole is closed at both ends
    assert ("cube", "hole_y", "cube") in found


@pytest.mark.parametrize(
    ("context", "cells"),
    [(("cube", None), 1), (("hole_x", "cube"), 51 / 27), (("hole_y", "hole_z"), 48 / 27)],
)
def test_surface_has_the_genus_and_volume_of_the_polycube(
    context: tuple, cells: float, primitives: dict
) -> None:
    shape = template((2, 1, 1), context, primitives)
    surface = TriMesh(shape.vertices, shape.faces)
    assert surface_genus(surface) == genus(shape.polycube)
    assert volume(surface) == pytest.approx(cells)
    assert shape.vertices.min(axis=0)[0] == (-1 if context[0] else 0)


def test_rounding_keeps_the_box_and_makes_the_surface_smoother(primitives: dict) -> None:
    shape = template((2, 1, 1), ("hole_z", "cube"), primitives)
    assert shape.rounded.shape == (len(SMOOTHING), *shape.vertices.shape)
    assert np.allclose(shape.rounded[0], shape.vertices)
    lengths = []
    for vertices in shape.rounded:
        assert vertices.min(axis=0) == pytest.approx(shape.vertices.min(axis=0))
        assert vertices.max(axis=0) == pytest.approx(shape.vertices.max(axis=0))
        corner = np.linalg.norm(vertices - np.array([-1, -0.5, -0.5]), axis=1).min()
        lengths.append(corner)
    assert (np.diff(lengths) > 0).all()  # corners retreat further and further
