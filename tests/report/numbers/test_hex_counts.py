"""Numbers of hexes through walls and round holes, and the requested ones."""

from dataclasses import replace

import numpy as np

from polycube.hexmesh.cad_faces import with_sets
from polycube.report.numbers.results import hex_counts
from tests.fixtures.hexmeshes import hex_box, surface_of

BOX = hex_box((4, 3, 1), (4.0, 3.0, 2.0))


def test_faces_with_fewer_hexes_are_listed_the_worst_first():
    low = BOX.vertices[BOX.quads].mean(axis=1)
    side = np.select([low[:, 2] == 0, low[:, 2] == 2, low[:, 1] == 0], [1, 2, 3], 4)
    surface = surface_of(BOX, side)
    found = hex_counts(with_sets(BOX, surface), surface, {"across_wall": 4})
    assert (found["walls"], found["holes"], found["at"]) == (4, 0, [])
    assert found["fewer"] == [
        {"at": "cad_face_1", "kind": "through", "wanted": 4, "reached": 1},
        {"at": "cad_face_2", "kind": "through", "wanted": 4, "reached": 1},
        {"at": "cad_face_3", "kind": "through", "wanted": 4, "reached": 3},
    ]


def test_without_settings_the_defaults_count(run):
    """Of the finished run one hex is under each side, and the hole has four."""
    found = hex_counts(run.hexes, run.surface, {})
    assert found["holes"] == 1
    around = [row for row in found["fewer"] if row["kind"] == "around"]
    assert around == [{"at": "hole_1", "kind": "around", "wanted": 8, "reached": 4}]
    assert hex_counts(run.hexes, run.surface, {"around_hole": 4, "across_wall": 1})["fewer"] == []


def test_entries_have_the_reached_number():
    side = np.where(BOX.vertices[BOX.quads][:, :, 2].min(axis=1) == 2, 1, 2)
    surface = surface_of(BOX, side)
    entries = [{"at": "cad_face_1", "around": 14}, {"at": "z_max", "through": 2}]
    found = hex_counts(with_sets(BOX, surface), surface, {"at": entries})
    assert found["at"] == [
        {"at": "cad_face_1", "kind": "around", "wanted": 14, "reached": 14, "met": True},
        {"at": "z_max", "kind": "through", "wanted": 2, "reached": 1, "met": False},
    ]
    bare = replace(BOX, sets={"x_min": np.zeros(1, int)})
    assert hex_counts(bare, surface, {"at": entries})["at"][0]["reached"] is None
