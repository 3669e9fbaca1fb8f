"""The leading mesh with smaller hexes or other numbers of parts: on meshes known exactly."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from polycube.errors import MeshingError
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import reached
from polycube.hexmesh.inspection import inspect
from polycube.plugins.meshing.subdivide import Template
from polycube.registry import build
from polycube.search.again import AGAIN, MARGIN, STEP, Again, AlongCreases, Closer, Finer, MoreParts
from polycube.search.history import History
from polycube.search.moves import MeshStructure, possible
from polycube.stages import Stage
from polycube.state import RunState
from polycube.structure.rough_map import identity_map
from polycube.types import HexMesh, Polycube, TriMesh, Verdict
from tests.fixtures import hexmeshes
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.stages import BySize, history, made, structure

SUBDIVIDE = "meshing/subdivide"


def barrel(parts: int, along: int | None = None) -> HexMesh:
    """So many hexes along each axis, and `along` along z; its vertices are on the barrel."""
    return hexmeshes.barrel((parts, parts, along or parts), 0.4)


@pytest.fixture(scope="module")
def surface() -> TriMesh:
    return surface_of(barrel(32))


@dataclass(frozen=True)
class Cut:
    """Stands for the subdivision: finer, with more parts along the creases, or sheared."""

    parts: int = 4
    finer: float = 1.0
    level: int | None = None
    turn: float = 0.0
    most: float = 9.0
    creases: str | None = None

    def __call__(self, surface: TriMesh, polycube: None, rough_map: None, blocks: None) -> HexMesh:
        if self.finer > self.most:
            raise MeshingError("too many")
        found = barrel(round(self.parts * self.finer), self.creases and 7)
        if self.finer == 1:
            return found
        shear = np.array([[1, 0, 0], [0, 1, 0], [self.turn, 0, 1]])
        return replace(found, vertices=found.vertices @ shear)

    def finer_options(self, times: float) -> dict[str, object] | None:
        """As the template's."""
        return None if self.level is not None else {"finer": times * self.finer}

    def crease_options(self, distance: float) -> dict[str, object] | None:
        """As the template's."""
        return None if self.level is not None else {"creases": f"{100 * distance}%"}


@dataclass(frozen=True)
class ByCount(BySize):
    """The mesh with more hexes is the better one; below a number it loses features."""

    least: int = 0

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        n = len(hexes.hexes)
        lost = max(0, self.least - n)
        return Verdict((), (), (-float(lost), n), {"features": 1.0} if lost else {}, lost)


def meshed(surface: TriMesh, acceptance=None, bundle=None, **options: object) -> History:
    """A history with the mesh of that subdivision."""
    found = history(
        [Stage(SUBDIVIDE, Cut(**options))],
        bundle,
        RunState(surface),
        acceptance or ByCount(),
        [structure(1.0)],
    )
    return made(found, MeshStructure(0, 0))


def again(found: History, kind: type[Again], most: int = 9) -> History:
    """The history after all moves of a kind that are possible."""
    for _ in range(most):
        moves = [move for move in possible(found) if type(move) is kind]
        if not moves:
            break
        assert moves == [kind(found.leader.number)]
        made(found, *moves)
    return found


def parts(found: History) -> int:
    return round(len(found.leader.state.hexes.hexes) ** (1 / 3))


def apart(found: History) -> float:
    """Distance in diagonals that 1 % of the points exceed, the worse of both ways."""
    return inspect(found.leader.state.hexes, found.task.start.surface).deviation.p99


@pytest.mark.parametrize(
    ("least", "most", "expected", "runs"),
    [(64, 9.0, 4, 1), (65, 9.0, 6, 2), (217, 9.0, 8, 3), (10_000, 9.0, 8, 3), (65, 1.2, 4, 2)],
    ids=["none is lost", "once", "twice", "no more", "a finer one fails"],
)
def test_lost_features_ask_for_smaller_hexes(surface, least, most, expected, runs):
    found = again(meshed(surface, ByCount(least=least), most=most), Finer)
    assert parts(found) == expected and len(found.moves) == runs <= 1 + AGAIN


@pytest.mark.parametrize("excess", [1.3, 30.0])
def test_the_size_follows_from_the_excess_of_the_farthest_feature(excess, surface, monkeypatch):
    """Distances are of order h^2: by the root of the excess, with a margin, in steps."""

    @dataclass(frozen=True)
    class Feature:
        size: float = 1.0

        def excess(self, goal: object) -> float:
            return excess

    @dataclass(frozen=True)
    class Inspection:
        features: list[Feature] = field(default_factory=lambda: [Feature()])

    found = meshed(surface, ByCount(least=99))
    monkeypatch.setattr(Again, "inspection", lambda *_: Inspection())
    times = Finer(0).options(found)["finer"]
    assert times == pytest.approx(min(MARGIN * excess**0.5, STEP))


def test_smaller_hexes_are_for_subdivisions_that_can_make_them(surface):
    assert again(meshed(surface, ByCount(least=999), level=2), Finer).leader.number == 0
    keep = [Stage("meshing/optimize", build("meshing/optimize", {"plugin": "polish"}))]
    plain = history(keep, start=RunState(surface, hexes=barrel(2)), acceptance=ByCount(least=99))
    plain.add(MeshStructure(0, 0), plain.task.start, {}, {})
    assert not [move for move in possible(plain) if isinstance(move, Again)]


@pytest.mark.parametrize("times", [1.3, 2.0, 3.0])
def test_the_size_that_meets_the_deviation_makes_fewer_hexes_than_refinement(surface, times):
    wanted = apart(meshed(surface)) / times
    found = again(meshed(surface, bundle={"deviation": f"{100 * wanted}%"}), Closer)
    assert apart(found) <= wanted
    assert 64 * times**1.5 <= len(found.leader.state.hexes.hexes) < 8 * 64
    coarser = barrel(parts(found) - 1)  # h^2: one step coarser does not do
    assert inspect(coarser, surface).deviation.p99 > wanted / 1.1


def test_a_deviation_in_model_units_and_the_variants_own_factor(surface):
    unit = np.linalg.norm(np.ptp(surface.vertices, axis=0))
    coarse = meshed(surface, parts=3, finer=4 / 3)
    wanted = apart(coarse) / 2
    found = again(
        meshed(surface, bundle={"deviation": wanted * unit}, parts=3, finer=4 / 3), Closer, 1
    )
    assert apart(found) <= wanted
    finer = found.leader.options[SUBDIVIDE]["finer"]
    assert finer == pytest.approx(4 / 3 * MARGIN * 2**0.5)


@pytest.mark.parametrize(
    ("times", "options"),
    [
        (0.9, {}),  # it is met
        (5.0, {}),  # refinement is cheaper
        (2.0, {"level": 2}),  # the number of parts is requested for
    ],
)
def test_otherwise_there_is_no_reason_for_another_size(surface, times, options):
    wanted = apart(meshed(surface)) / times
    found = meshed(surface, bundle={"deviation": f"{100 * wanted}%"}, **options)
    assert again(found, Closer).moves == [MeshStructure(0, 0)]
    assert again(meshed(surface), Closer).moves == [MeshStructure(0, 0)]  # nothing is asked


@pytest.mark.parametrize("options", [{"turn": 3.0}, {"most": 1.2}])
def test_a_mesh_that_is_worse_is_not_taken(surface, options):
    acceptance = build("acceptance", {"plugin": "standard", "least_jacobian": 0.0})
    wanted = apart(meshed(surface)) / 2
    bundle = {"deviation": f"{100 * wanted}%"}
    found = again(meshed(surface, acceptance, bundle, **options), Closer)
    assert parts(found) == 4 and found.leader.number == 0
    [row] = found.table[1:]
    assert row.gain == 0 and ("not valid" in row.result or row.result == "too many")


def off(found: History) -> float:
    """Distance of the sharp edges in diagonals."""
    return inspect(found.leader.state.hexes, found.task.start.surface).creases


@pytest.mark.parametrize("creases", ["auto", "0.1%", 0.003])
def test_more_parts_along_the_creases(surface, creases):
    found = meshed(surface, bundle={"creases": creases})
    before = off(found)
    again(found, AlongCreases, 1)
    assert len(found.leader.state.hexes.hexes) == 16 * 7
    assert off(found) < 0.5 * before  # (4 / 7)^2


@pytest.mark.parametrize(
    ("creases", "options"),
    [
        (None, {}),  # nothing is requested
        ("9%", {}),  # it is met
        ("0.1%", {"level": 2}),  # the number of parts is requested for
    ],
)
def test_no_reason_for_more_parts_along_the_creases(surface, creases, options):
    found = again(meshed(surface, bundle={"creases": creases}, **options), AlongCreases)
    assert found.moves == [MeshStructure(0, 0)]


def test_the_edges_of_cad_faces_have_limits_of_their_own(surface):
    region = np.ones(len(surface.faces), int)
    cad = TriMesh(surface.vertices, surface.faces, region=region)
    found = again(meshed(cad, bundle={"creases": "auto"}), AlongCreases)
    assert found.moves == [MeshStructure(0, 0)]


SLAB = Polycube(np.ones((1, 1, 1)), [0, 4], [0, 4], [0, 1], (1, 1, 1), ("cube",))
BOX = surface_of(hex_box((8, 8, 2), (4.0, 4.0, 1.0)))


@dataclass(frozen=True)
class Layered:
    """Stands for the pillow: so many layers under the whole boundary."""

    layers: int = 1

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        from polycube.fitting.pillow import layer

        for _ in range(self.layers):
            hexes = layer(hexes, hexes.patch, np.ones(len(hexes.patch), bool))
        return hexes


@dataclass(frozen=True)
class Nearest(BySize):
    """The mesh is better that is nearer to the request."""

    at: tuple = ()

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        requests = requests_of(self.at)
        has = reached(hexes, surface, requests)
        off = sum(abs(r.wanted(surface) - h) for r, h in zip(requests, has, strict=True))
        return Verdict((), (), (-off,), {"wishes": off} if off else {})


def slab(at: list[dict[str, object]], layers: int = 1, **options: object) -> History:
    """One run on a slab of 4 x 4 x 1, whose boundary gets layers."""
    entry = structure(1.0)
    candidate = replace(entry.candidate, polycube=SLAB, rough_map=identity_map(SLAB))
    found = history(
        [
            Stage(SUBDIVIDE, Template(size=1.0, curvature=None, at=at, **options)),
            Stage("meshing/pillow", Layered(layers)),
        ],
        start=RunState(BOX),
        acceptance=Nearest(at=tuple(at)),
        ranked=[replace(entry, candidate=candidate)],
    )
    return made(found, MeshStructure(0, 0))


def has(found: History, at: list[dict[str, object]]) -> list[float | None]:
    return reached(found.leader.state.hexes, BOX, requests_of(at))


@pytest.mark.parametrize(
    ("layers", "number", "first"), [(0, 3, 3), (1, 3, 5), (1, 6, 8), (2, 5, 9)]
)
def test_the_final_mesh_has_the_number_through_the_wall(layers, number, first):
    at = [{"at": "z_max", "through": number}]
    found = slab(at, layers)
    assert has(found, at) == [first]
    again(found, MoreParts)
    assert has(found, at) == [number]
    assert len(found.moves) == (1 if first == number else 2)


def test_a_lattice_has_one_part_at_least():
    at = [{"at": "z_max", "through": 2}]
    found = again(slab(at), MoreParts)
    assert has(found, at)[0] == 3  # a part, and a layer on each side


@pytest.mark.parametrize(
    ("at", "options"),
    [
        ([{"at": "z_max", "around": 12}], {}),  # it is met
        ([], {}),  # nothing is requested
        ([{"at": "z_max", "through": 3}], {"level": 0}),  # there are no parts to change
    ],
)
def test_no_reason_for_other_numbers_of_parts(at, options):
    found = again(slab(at, **options), MoreParts)
    assert found.moves == [MeshStructure(0, 0)]


def test_nothing_is_repeated_without_a_mesh():
    found = slab([{"at": "z_max", "through": 3}], max_hexes=1)
    assert found.leader is None
    assert not [move for move in possible(found) if isinstance(move, Again)]
