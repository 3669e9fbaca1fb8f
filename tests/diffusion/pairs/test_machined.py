"""Pairs of a grid with the shapes of machined parts."""

import numpy as np
import pytest

from docs.notes.machined_pairs import Machined, MachinedPairs
from polycube.structure.lattice import OUTWARD, boundary, cell_and_wall, lattice
from tests.fixtures.polycubes import PRIMITIVES

GRID = (2, 1, 1)


@pytest.fixture(scope="module")
def machined() -> MachinedPairs:
    return Machined()(GRID, PRIMITIVES, 3)


@pytest.mark.parametrize("index", range(0, 24, 3))
def test_points_lie_on_a_face_of_the_polycube_with_their_labels(
    index: int, machined: MachinedPairs
) -> None:
    """Searched among all faces of the boxes of the lattice."""
    pair = machined(index)
    solid = lattice(GRID, pair.context, PRIMITIVES)
    faces = boundary(solid)
    labels = np.stack([faces.axis, *cell_and_wall(solid, faces)], axis=1)
    corners = faces.vertices[faces.quads] - np.array(GRID) / 2  # (Q, 4, 3)
    low, high = corners.min(axis=1) - 1e-9, corners.max(axis=1) + 1e-9
    at = pair.polycube[:, None]
    is_on = ((low <= at) & (at <= high)).all(axis=2)  # (N, Q)
    assert (is_on & (pair.labels[:, None] == labels).all(axis=2)).any(axis=1).all()


def test_normals_look_along_the_axes_of_their_labels(machined: MachinedPairs) -> None:
    """Machined faces mostly do: plane faces, and the quarters of round holes."""
    pairs = [machined(index) for index in range(24)]
    along = np.concatenate([(OUTWARD[p.labels[:, 0]] * p.normals).sum(axis=1) for p in pairs])
    assert (along > np.cos(np.radians(60))).mean() > 0.97
    assert (along > 0.95).mean() > 0.6


def test_pairs_depend_on_their_number_and_fill_the_box(machined: MachinedPairs) -> None:
    first, again = machined(7), Machined()(GRID, PRIMITIVES, 3)(7)
    assert np.array_equal(first.geometry, again.geometry)
    assert not np.array_equal(first.geometry, machined(7 + 24).geometry)
    assert np.ptp(first.geometry, axis=0).max() == pytest.approx(2, abs=0.1)
