"""Faces with flat corners."""

import numpy as np
import pytest

from polycube.fitting.cures.fitted import fitted, with_flat_corners
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod


@pytest.fixture(scope="module")
def rod():
    surface, mesh = lattice_on_rod()
    return fitted(mesh, target(surface))


def test_the_ends_of_a_rod_have_flat_corners_and_its_wall_has_none(rod):
    found = dict(with_flat_corners(rod))
    assert set(found) == {1, 2}
    height = rod.target.to_model(rod.mesh.vertices)[rod.mesh.hexes].mean(axis=1)[:, 2]
    for face, inside in found.items():
        assert inside.sum() == 36
        assert (abs(height[inside] - 2 * (face - 1)) < 0.5).all()


def test_parts_are_the_cad_faces(rod):
    for number in np.unique(rod.part):
        assert len(np.unique(rod.cad_face[rod.part == number])) == 1
