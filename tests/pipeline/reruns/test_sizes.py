"""A smaller size for a deviation, on a barrel whose meshes lie on it exactly."""

import logging
from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.errors import MeshingError
from polycube.hexmesh.inspection import inspect
from polycube.pipeline.reruns.sizes import keep_features, meet_deviation
from polycube.stages import Stage
from polycube.state import RunState
from polycube.pipeline.variants import Variants
from polycube.registry import build
from polycube.types import HexMesh, TriMesh, Verdict
from tests.fixtures import hexmeshes
from tests.fixtures.hexmeshes import surface_of
from tests.fixtures.stages import BySize


def barrel(parts: int) -> HexMesh:
    """So many hexes along each axis."""
    return hexmeshes.barrel((parts, parts, parts), 0.4)


@pytest.fixture(scope="module")
def surface() -> TriMesh:
    return surface_of(barrel(32))


@dataclass(frozen=True)
class Cut:
    """Stands for the subdivision: `parts` times finer; where that is more than one, perhaps bad."""

    parts: int = 4
    finer: float = 1.0
    level: int | None = None
    turn: float = 0.0
    most: float = 9.0

    def __call__(self, surface: TriMesh, polycube: None, rough_map: None, blocks: None) -> HexMesh:
        if self.finer > self.most:
            raise MeshingError("too many")
        found = barrel(round(self.parts * self.finer))
        if self.finer == 1:
            return found
        return replace(
            found, vertices=found.vertices @ np.array([[1, 0, 0], [0, 1, 0], [self.turn, 0, 1]])
        )

    def finer_options(self, times: float) -> dict[str, object] | None:
        """As the template's."""
        return None if self.level is not None else {"finer": times * self.finer}


def found_by(surface: TriMesh, **options: object) -> Variants:
    """One run of that subdivision."""
    stages = [Stage("meshing/subdivide", Cut(**options))]
    acceptance = build("acceptance", {"plugin": "standard", "least_jacobian": 0.0})
    found = Variants(stages, [{}], RunState(surface), acceptance)
    found.run(0)
    return found


def off(hexes: HexMesh, surface: TriMesh) -> float:
    """Distance in diagonals that 1 % of the points exceed, the worse of both ways."""
    apart = inspect(hexes, surface).deviation
    return max(apart.to_surface.p99, apart.to_mesh.p99)


def apart(found: Variants) -> float:
    return off(found.finish()[0].hexes, found.start.surface)


@pytest.mark.parametrize("times", [1.3, 2.0, 3.0])
def test_the_size_that_meets_it_makes_fewer_hexes_than_refinement(surface, times):
    found = found_by(surface)
    wanted = apart(found) / times
    meet_deviation(found, f"{100 * wanted}%")
    end, path = found.finish()
    assert apart(found) <= wanted and path == (end.hexes,)
    assert 64 * times**1.5 <= len(end.hexes.hexes) < 8 * 64
    # h^2: one step coarser does not do
    parts = round(len(end.hexes.hexes) ** (1 / 3))
    assert off(barrel(parts - 1), surface) > wanted / 1.1


def test_a_length_in_model_units_and_the_variants_own_factor(surface):
    found = found_by(surface, parts=3, finer=4 / 3)
    unit = np.linalg.norm(np.ptp(surface.vertices, axis=0))
    wanted = apart(found) / 2
    meet_deviation(found, wanted * unit)
    assert apart(found) <= wanted
    plugin = found.plugin("meshing/subdivide")
    assert plugin.finer == pytest.approx(4 / 3 * 1.05 * 2**0.5)


@pytest.mark.parametrize(
    ("times", "options", "message"),
    [
        (0.9, {}, ""),  # it is met
        (5.0, {}, "refinement is cheaper"),
        (2.0, {"level": 2}, ""),  # the number of parts is requested for
        (2.0, {"turn": 3.0}, "the previous mesh is the result, because: mesh and surface are"),
        (2.0, {"most": 1.2}, "too many"),
    ],
)
def test_otherwise_the_mesh_stays_and_the_log_says_why(surface, times, options, message, caplog):
    found = found_by(surface, **options)
    before = found.finish()[0].hexes
    caplog.set_level(logging.INFO)
    meet_deviation(found, f"{100 * apart(found) / times}%")
    assert found.finish()[0].hexes is before
    assert message in caplog.text and bool(message) == ("deviation" in caplog.text)


def test_nothing_is_asked(surface):
    found = found_by(surface)
    meet_deviation(found, None)
    assert list(found.attempts) == [(0, False)]
    assert inspect(found.taken().state.hexes, surface).scaled_jacobian > 0.5


@dataclass(frozen=True)
class Keep:
    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        return hexes


def test_a_chain_without_sizes_is_left_alone(surface):
    state = RunState(surface, hexes=barrel(2))
    acceptance = build("acceptance", {"plugin": "standard"})
    found = Variants([Stage("meshing/optimize", Keep())], [{}], state, acceptance)
    found.run(0)
    meet_deviation(found, "0.01%")
    assert list(found.attempts) == [(0, False)]


@dataclass(frozen=True)
class Losing(BySize):
    """Stands for an acceptance: features are lost below so many hexes."""

    least: int = 0

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        lost = max(0, self.least - len(hexes.hexes))
        return Verdict((), (), (-float(lost),), 1.0, lost)


@pytest.mark.parametrize(
    ("least", "most", "expected"),
    [(64, 9.0, 4), (65, 9.0, 6), (217, 9.0, 8), (10_000, 9.0, 8), (65, 1.2, 4)],
    ids=["none is lost", "once", "twice", "no more", "a finer one fails"],
)
def test_lost_features_ask_for_smaller_hexes(surface, least, most, expected):
    stages = [Stage("meshing/subdivide", Cut(most=most))]
    found = Variants(stages, [{}], RunState(surface), Losing(least=least))
    found.run(0)
    keep_features(found)
    assert len(found.finish()[0].hexes.hexes) == expected**3


def test_a_poor_mesh_is_not_worth_a_finer_one(surface):
    found = Variants(
        [Stage("meshing/subdivide", Cut())], [{}], RunState(surface), Losing(least=1000)
    )
    keep_features(found, least=0.4)  # nothing has run yet
    found.run(0)
    keep_features(found, least=0.99)
    assert list(found.attempts) == [(0, False)]
    keep_features(found, least=0.1)
    assert len(found.attempts) > 1


def test_a_chord_error_a_little_too_large_asks_for_hexes_a_little_smaller():
    """A CAD face is 0.4 % off, the tolerance is 0.3 %: by the root of 4/3, and a margin."""
    fine, mesh = barrel(32), barrel(4)
    used, quads = np.unique(fine.quads, return_inverse=True)
    quads = quads.reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    double = TriMesh(fine.vertices[used], faces, np.tile(fine.patch + 1, 2))
    found = Variants([Stage("meshing/subdivide", Cut())], [{}], RunState(double), Losing(least=65))
    found.run(0)
    farthest = max(each.distance for each in inspect(mesh, double).features)
    keep_features(found)
    times = min(1.05 * (farthest / 0.003) ** 0.5, 1.4)
    assert found.plugin("meshing/subdivide").finer == pytest.approx(times)


def test_where_smaller_hexes_keep_no_more_the_mesh_stays(surface):
    found = found_by(surface)
    found.acceptance = BySize()  # it finds all meshes equal
    keep_features(found)
    assert len(found.attempts) == 1
