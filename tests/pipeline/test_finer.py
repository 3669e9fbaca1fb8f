"""A smaller size for a deviation, on a barrel whose meshes lie on it exactly."""

import logging
from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.errors import MeshingError
from polycube.hexmesh.quality import quality
from polycube.hexmesh.template import mesh
from polycube.pipeline import finer
from polycube.pipeline.finer import meet
from polycube.pipeline.portfolio import Portfolio
from polycube.pipeline.stages import Clock, Stage
from polycube.structure.rough_map import affine_map
from polycube.types import HexMesh, Polycube, TriMesh

CUBE = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))


def barrel(parts: int) -> HexMesh:
    """So many hexes along each axis, the sides bulging like a parabola."""
    block = mesh(CUBE, affine_map(CUBE, 2 * np.eye(3), -np.ones(3)), ([parts],) * 3)
    x = block.vertices.copy()
    x[:, :2] *= 1.4 - 0.4 * x[:, 2:] ** 2
    return replace(block, vertices=x)


@pytest.fixture(scope="module")
def surface() -> TriMesh:
    fine = barrel(32)
    used, quads = np.unique(fine.quads, return_inverse=True)
    quads = quads.reshape(-1, 4)
    return TriMesh(fine.vertices[used], np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


@dataclass(frozen=True)
class Cut:
    """Stands for the subdivision: `parts` times finer; where that is more than one, perhaps bad."""

    parts: int = 4
    curvature: float | str | None = None
    finer: float = 1.0
    level: int | None = None
    turn: float = 0.0
    most: float = 9.0

    def __call__(self, surface: TriMesh, polycube: None, rough_map: None) -> HexMesh:
        if self.finer > self.most:
            raise MeshingError("too many")
        found = barrel(round(self.parts * self.finer))
        if self.finer == 1:
            return found
        return replace(
            found, vertices=found.vertices @ np.array([[1, 0, 0], [0, 1, 0], [self.turn, 0, 1]])
        )


def portfolio(surface: TriMesh, **options: object) -> Portfolio:
    """One run of that subdivision."""
    state = {"surface": surface, "polycube": None, "rough_map": None}
    stages = [Stage("meshing/subdivide", Cut(**options))]
    found = Portfolio(stages, [{}], state, Clock(), lambda end: len(end["hexes"].hexes))
    found.run(0)
    return found


def apart(found: Portfolio) -> float:
    return finer._apart(found.result()[0]["hexes"], found.state["surface"])


@pytest.mark.parametrize("times", [1.3, 2.0, 3.0])
def test_the_size_that_meets_it_makes_fewer_hexes_than_refinement(surface, times):
    found = portfolio(surface)
    wanted = apart(found) / times
    meet(found, f"{100 * wanted}%")
    end, path = found.result()
    assert apart(found) <= wanted and path == [end["hexes"]]
    assert 64 * times**1.5 <= len(end["hexes"].hexes) < 8 * 64
    # h^2: one step coarser does not do
    parts = round(len(end["hexes"].hexes) ** (1 / 3))
    assert finer._apart(barrel(parts - 1), surface) > wanted / 1.1


def test_a_length_in_model_units_and_the_variants_own_factor(surface):
    found = portfolio(surface, parts=3, finer=4 / 3, curvature="0.4%")
    unit = np.linalg.norm(np.ptp(surface.vertices, axis=0))
    wanted = apart(found) / 2
    meet(found, wanted * unit)
    assert apart(found) <= wanted
    plugin = found.chosen_plugin("meshing/subdivide")
    assert plugin.finer == pytest.approx(4 / 3 * 1.05 * 2**0.5)
    assert plugin.curvature == pytest.approx(0.004 * unit / (1.05 * 2**0.5) ** 2)


@pytest.mark.parametrize(
    ("times", "options", "said"),
    [
        (0.9, {}, ""),  # it is met
        (5.0, {}, "every hex in eight is the cheaper way"),
        (2.0, {"level": 2}, ""),  # the number of parts is asked for
        (2.0, {"turn": 3.0}, "the mesh before is kept, for boundary vertices lie"),
        (2.0, {"most": 1.2}, "too many"),
    ],
)
def test_else_the_mesh_stays_and_the_log_says_why(surface, times, options, said, caplog):
    found = portfolio(surface, **options)
    before = found.result()[0]["hexes"]
    caplog.set_level(logging.INFO)
    meet(found, f"{100 * apart(found) / times}%")
    assert found.result()[0]["hexes"] is before
    assert said in caplog.text and bool(said) == ("deviation" in caplog.text)


def test_nothing_is_asked(surface):
    found = portfolio(surface)
    meet(found, None)
    assert list(found.scores) == [(0, False)]
    assert quality(found.end["hexes"], surface).scaled_jacobian > 0.5


@dataclass(frozen=True)
class Keep:
    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        return hexes


def test_a_chain_without_sizes_is_left_alone(surface):
    state = {"surface": surface, "hexes": barrel(2)}
    found = Portfolio([Stage("meshing/optimize", Keep())], [{}], state, Clock(), lambda _: 0.0)
    found.run(0)
    meet(found, "0.01%")
    assert list(found.scores) == [(0, False)]
