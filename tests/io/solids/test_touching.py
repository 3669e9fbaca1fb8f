"""Surfaces of touching solids of a CAD file: common faces with common triangles."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.solids.touching import touching
from polycube.surface.measures import face_areas, is_closed, volume
from tests.fixtures import assemblies

SEGMENTS = 24


@pytest.fixture(scope="module")
def bolt_and_plate(tmp_path_factory):
    [group] = touching(assemblies.write("bolted", tmp_path_factory.mktemp("bolted")), SEGMENTS)
    return group


def test_solids_that_touch_are_a_group_and_others_in_none(tmp_path):
    path = assemblies.write("cubes", tmp_path)
    [group] = touching(path, SEGMENTS)
    assert list(group) == [1, 2, 3]  # the fourth is far off
    assert [volume(each) for each in group.values()] == pytest.approx([1000, 1000, 125])
    assert group[3].vertices.min(axis=0) == pytest.approx([3, 3, 10])
    assert [each.region.max() for each in group.values()] == [7, 6, 6]  # the top has a square in it


def test_common_faces_have_the_same_triangles(bolt_and_plate):
    plate, bolt = bolt_and_plate.values()
    assert is_closed(plate.faces) and is_closed(bolt.faces)
    corners = [np.sort(each.vertices[each.faces].round(9), axis=1) for each in (plate, bolt)]
    middles = [{*map(tuple, each.mean(axis=1).round(6).tolist())} for each in corners]
    shared = middles[0] & middles[1]
    own = [tuple(x) in shared for x in corners[0].mean(axis=1).round(6).tolist()]
    # the wall of the hole, and the ring under the head, from r = 5 to 9
    wanted = 2 * np.pi * 5 * 10 + np.pi * (81 - 25)
    assert face_areas(plate)[own].sum() == pytest.approx(wanted, rel=0.02)


def test_surfaces_face_outwards_with_whole_cad_faces(bolt_and_plate):
    plate, bolt = bolt_and_plate.values()
    assert volume(plate) == pytest.approx(24000 - np.pi * 250, rel=0.01)
    assert volume(bolt) == pytest.approx(np.pi * (81 * 6 + 250), rel=0.01)
    for each in (plate, bolt):
        assert len(each.region_names) == each.region.max() == len(np.unique(each.region))


def test_overlapping_solids_are_refused(tmp_path):
    with pytest.raises(InputError, match="the solids overlap, or Open CASCADE cannot divide"):
        touching(assemblies.write("overlapping", tmp_path), SEGMENTS)
