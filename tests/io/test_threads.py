"""Screw threads of CAD parts written by gmsh, replaced by cylinders."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.cad import Cad, read_cad
from polycube.io.tessellation.threads import without_threads
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import genus, is_closed, misoriented_edges, volume
from tests.fixtures.cad_parts import run_alone

CHAMFER = np.pi / 3 * (3**3 - 2.3**3)  # volume of a frustum .7 high
SCREW = np.pi * (5**2 * 4 + 3**2 * 8.3) + CHAMFER
BLOCK = 16 * 16 * 10 - np.pi * 4**2 * 10


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("threads")
    run_alone("tests.fixtures.threads", place)
    return place


@pytest.fixture(scope="module")
def threaded(folder):
    return read_cad(folder / "screw.step", Cad(threads="keep"))[0]


@pytest.mark.slow
def test_the_thread_of_a_screw_becomes_its_shank(threaded):
    found, notes = without_threads(threaded, "mm")
    assert volume(threaded) < 0.96 * SCREW
    assert abs(volume(found) / SCREW - 1) < 0.005
    assert is_closed(found.faces) and not len(misoriented_edges(found.faces)) and genus(found) == 0
    assert not len(self_intersections(found))
    assert notes == [
        "a thread with a diameter of 6 mm and a pitch of 1 mm is replaced by its cylinder; "
        "cad.threads=keep keeps it"
    ]
    shapes = [found.region_shapes[number - 1] for number in np.unique(found.region)]
    assert sorted(shapes) == ["cone", "cylinder", "cylinder", "plane", "plane", "plane"]
    for number in np.unique(found.region)[np.array(shapes) == "cylinder"]:
        x = found.vertices[found.faces[found.region == number]].reshape(-1, 3)
        radius = np.hypot(x[:, 0], x[:, 1])
        assert np.abs(radius - radius.mean()).max() < 1e-3 * radius.mean()
    cone = found.vertices[found.faces[found.region == _only("cone", found)]].reshape(-1, 3)
    rim = cone[np.hypot(cone[:, 0], cone[:, 1]) > 2.99]
    assert np.abs(rim[:, 2] - 0.7).max() < 0.015  # 0.1 % of the diagonal, for 48 segments


@pytest.mark.slow
def test_a_moved_and_turned_screw_is_the_same(threaded):
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    moved = replace(threaded, vertices=20 * threaded.vertices @ turn.T + [100, -30, 7])
    found, again = without_threads(threaded)[0], without_threads(moved)[0]
    assert len(found.faces) == len(again.faces)
    assert np.isclose(volume(again), 20**3 * volume(found), rtol=1e-4)


@pytest.mark.slow
def test_the_thread_of_a_hole_becomes_the_hole(folder):
    found, notes = read_cad(folder / "tapped_block.step", Cad())
    assert "diameter of 8 mm and a pitch of 1.25 mm is replaced" in notes[0]
    assert abs(volume(found) / BLOCK - 1) < 0.001
    assert genus(found) == 1 and not len(self_intersections(found))
    assert sorted(np.unique(found.region)) == [1, 2, 3, 4, 5, 6, _only("cylinder", found)]


@pytest.mark.slow
def test_a_thread_with_a_hole_across_it_is_kept(folder):
    path = folder / "crossed_screw.step"
    found, notes = read_cad(path, Cad())
    assert notes[0].endswith("pitch of 1 mm is kept: other faces cut into its cylinder")
    assert np.array_equal(found.faces, read_cad(path, Cad(threads="keep"))[0].faces)


def test_an_unknown_choice_is_refused():
    with pytest.raises(InputError, match=r"cad\.threads must be one of absorb, keep; got 'drop'"):
        Cad(threads="drop")


def _only(shape, surface):
    [number] = [n for n in np.unique(surface.region) if surface.region_shapes[n - 1] == shape]
    return number
