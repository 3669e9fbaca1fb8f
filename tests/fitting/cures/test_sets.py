"""Sets of hexes round which a sheet may help."""

import numpy as np
import pytest

from polycube.fitting.cures.fitted import fitted
from polycube.fitting.cures.sets import Faces
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


def test_sets_near_a_hex_hold_it_or_are_under_its_face(whole):
    faces = Faces(whole)
    bad = int(faces.owner[faces.flat][0])
    sets = list(faces.near(bad))
    assert 36 in [each.sum() for each in sets]
    proper = [each for each in sets if each.any() and not each.all()]
    assert len(proper) > 5
    assert sum(each[bad] for each in proper) > len(proper) / 2
