"""Other numbers of parts where layers under the boundary count as hexes through a wall."""

from dataclasses import dataclass

import numpy as np
import pytest

from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.pipeline.reruns.requests import meet_requests
from polycube.stages import Stage
from polycube.state import RunState
from polycube.pipeline.variants import Variants
from polycube.plugins.meshing.subdivide import Template
from polycube.registry import build
from polycube.structure.rough_map import identity_map
from polycube.types import HexMesh, Polycube, TriMesh, Verdict
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.stages import BySize

SLAB = Polycube(np.ones((1, 1, 1)), [0, 4], [0, 4], [0, 1], (1, 1, 1), ("cube",))
SURFACE = surface_of(hex_box((8, 8, 2), (4.0, 4.0, 1.0)))


@dataclass(frozen=True)
class Layered:
    """Stands for the pillow: so many layers under the whole boundary."""

    layers: int = 1

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        from polycube.fitting.pillow import layer

        for _ in range(self.layers):
            hexes = layer(hexes, hexes.patch, np.ones(len(hexes.patch), bool))
        return hexes


def found_by(at, layers=1, acceptance=None, **options):
    """One run on a slab of 4 x 4 x 1."""
    state = RunState(SURFACE, polycube=SLAB, rough_map=identity_map(SLAB))
    stages = [
        Stage("meshing/subdivide", Template(size=1.0, curvature=None, at=at, **options)),
        Stage("meshing/pillow", Layered(layers)),
    ]
    found = Variants(stages, [{}], state, acceptance or BySize())
    found.run(0)
    return found


def has(found, at):
    return reached(found.taken().state.hexes, SURFACE, requests_of(at))


@pytest.mark.parametrize(
    ("layers", "number", "first"), [(0, 3, 3), (1, 3, 5), (1, 6, 8), (2, 5, 9)]
)
def test_the_final_mesh_has_the_number(layers, number, first):
    at = [{"at": "z_max", "through": number}]
    found = found_by(at, layers)
    assert has(found, at) == [first]
    meet_requests(found)
    assert has(found, at) == [number]
    assert len(found.attempts) == (1 if first == number else 2)


def test_a_lattice_has_one_part_at_least():
    at = [{"at": "z_max", "through": 2}]
    found = found_by(at)
    meet_requests(found)
    assert has(found, at)[0] == 3  # a part, and a layer on each side


def test_what_is_met_is_not_run_again():
    at = [{"at": "z_max", "around": 12}]
    found = found_by(at)
    meet_requests(found)
    assert list(found.attempts) == [(0, False)]
    assert has(found, at) == [12]
    without = found_by([])
    meet_requests(without)
    assert list(without.attempts) == [(0, False)]


def test_a_lattice_as_fine_as_the_hexes_has_no_parts_to_change():
    at = [{"at": "z_max", "through": 3}]
    found = found_by(at, level=0)
    meet_requests(found)
    assert list(found.attempts) == [(0, False)]


@dataclass(frozen=True)
class Losing(BySize):
    """Stands for an acceptance: a mesh of fewer hexes than a number loses a feature."""

    least: int = 0

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        return Verdict((), (), (1.0,), 1.0, lost=int(len(hexes.hexes) < self.least))


def test_a_mesh_that_loses_more_is_not_taken():
    at = [{"at": "z_max", "through": 3}]
    many = len(found_by(at).taken().state.hexes.hexes)
    found = found_by(at, acceptance=Losing(least=many))
    meet_requests(found)
    assert len(found.attempts) == 2
    assert has(found, at) == [5]


def test_nothing_was_made():
    found = found_by([{"at": "z_max", "through": 3}], max_hexes=1)
    meet_requests(found)
    assert not found.attempts


def test_plugins_without_such_numbers_are_left_alone():
    plugin = build("meshing/optimize", {"plugin": "polish"})
    state = RunState(SURFACE, hexes=hex_box((2, 2, 2)))
    found = Variants([Stage("meshing/optimize", plugin)], [{}], state, BySize())
    found.run(0)
    meet_requests(found)
    assert list(found.attempts) == [(0, False)]
