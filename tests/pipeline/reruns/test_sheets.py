"""Sheets at the faces that gain by them: what is tried, and when nothing is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.pipeline.reruns.sheets import PILLOW, keep_good_sheets
from polycube.pipeline.search import Variants
from polycube.pipeline.stages import Stage
from polycube.pipeline.state import RunState
from polycube.surface.measures import face_normals
from polycube.types import HexMesh, TriMesh, Verdict
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.stages import BySize

BOX = hex_box((4, 4, 4), (4.0, 4.0, 4.0))
PLAIN = surface_of(BOX)
NORMALS = face_normals(PLAIN)
SIDES = 1 + 2 * np.abs(NORMALS).argmax(axis=1) + (NORMALS.sum(axis=1) > 0)  # -x, +x, -y ... from 1
CUBE = replace(PLAIN, region=SIDES)
ALL, NONE = ({PILLOW: {"sheets": "all"}}, {PILLOW: {"sheets": "none"}})


@dataclass(frozen=True)
class Sheets:
    """Stands for the pillow: moves the middle vertex of some sides of a cube within the side."""

    sheets: str = "all"
    bare: Sequence[int] = ()
    harmed: tuple[int, ...] = ()
    cured: tuple[int, ...] = ()

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        bad = {f for f in self.cured if self.sheets == "none" or f in self.bare}
        bad |= {f for f in self.harmed if self.sheets == "all" and f not in self.bare}
        vertices = hexes.vertices.copy()
        for side in bad:
            axis, end = divmod(side - 1, 2)
            middle = np.full(3, 2.0)
            middle[axis] = 4 * end
            vertices[np.linalg.norm(vertices - middle, axis=1).argmin(), (axis + 1) % 3] += 0.7
        return replace(hexes, vertices=vertices)


@dataclass(frozen=True)
class ByJacobian(BySize):
    """The mesh whose worst hex is better is the better one."""

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        worst = float(scaled_jacobian(hexes.vertices, hexes.hexes).min())
        return Verdict((), (), (worst,), worst)


def found_by(surface=CUBE, variants=(ALL, NONE), acceptable=0.9, **faces) -> Variants:
    state = RunState(surface, hexes=BOX)
    acceptance = ByJacobian(acceptable=acceptable)
    found = Variants([Stage(PILLOW, Sheets(**faces))], list(variants), state, acceptance)
    for number in range(len(variants)):
        found.run(number)
    return found


def poor_sides(mesh: HexMesh) -> set[int]:
    """Sides with a hex that is not a cube, and one that no other side has."""
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)[quad_sides(mesh)[0]]
    middles = mesh.vertices[mesh.quads].mean(axis=1)
    poor = quality < 0.9
    return {
        1 + 2 * axis + end
        for axis in range(3)
        for end in (0, 1)
        if (poor & (middles[:, axis] == 4 * end)).sum() > 1
    }


def test_the_faces_that_sheets_make_worse_get_none():
    found = found_by(harmed=(1,), cured=(4,))
    assert poor_sides(found.attempts[0, False].state.hexes) == {1}
    assert poor_sides(found.attempts[1, False].state.hexes) == {4}
    keep_good_sheets(found)
    assert found.variants[-1][PILLOW] == {"sheets": "all", "bare": (1,)}
    assert poor_sides(found.taken().state.hexes) == set()


@pytest.mark.parametrize("faces", [{"harmed": (1, 5)}, {"cured": (2, 3)}, {}])
def test_where_sheets_do_all_good_or_all_harm_nothing_is_tried(faces):
    found = found_by(**faces)
    keep_good_sheets(found)
    assert len(found.attempts) == 2


@pytest.mark.parametrize(
    "given",
    [{"acceptable": 0.1}, {"surface": PLAIN}, {"variants": (ALL,)}, {"variants": ({}, ALL)}],
)
def test_a_good_mesh_and_parts_without_cad_faces_or_both_variants_are_left_alone(given):
    found = found_by(**given, harmed=(1,), cured=(4,))
    before = len(found.attempts)
    keep_good_sheets(found)
    assert len(found.attempts) == before
