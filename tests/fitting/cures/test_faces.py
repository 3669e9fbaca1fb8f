"""Faces with flat corners."""

import numpy as np
import pytest

from polycube.fitting.cures.faces import Faces
from polycube.fitting.cures.fitted import fitted
from polycube.surface.fit_target import target
from tests.fixtures.cures import lattice_on_rod


@pytest.fixture(scope="module")
def whole():
    surface, mesh = lattice_on_rod()
    return fitted(mesh, target(surface))


def test_the_ends_of_a_rod_have_flat_corners_and_its_wall_has_none(whole):
    found = dict(Faces(whole).with_flat_corners(whole.cad_face))
    assert set(found) == {1, 2}
    height = whole.target.to_model(whole.mesh.vertices)[whole.mesh.hexes].mean(axis=1)[:, 2]
    for face, inside in found.items():
        assert inside.sum() == 36
        assert (abs(height[inside] - 2 * (face - 1)) < 0.5).all()


def test_parts_are_the_faces(whole):
    faces = Faces(whole)
    for number in np.unique(faces.part):
        assert len(np.unique(whole.cad_face[faces.part == number])) == 1
