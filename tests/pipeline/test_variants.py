"""Runs of the stages in variants, on small made-up stages."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.connectivity import hex_mesh
from polycube.stages import Stage
from polycube.state import RunState
from polycube.pipeline.variants import Variants
from polycube.types import HexMesh, Labels, Polycube, RoughMap, TriMesh
from tests.fixtures.stages import CALLS, START, TETRAHEDRON, TRIAL, BySize, Grow, cube, size


@pytest.fixture(autouse=True)
def forget() -> None:
    CALLS.clear()


@dataclass(frozen=True)
class Scale:
    factor: float = 1.0

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append(self.factor)
        if self.factor == np.inf:
            raise ValueError("factor inf")
        return replace(hexes, vertices=self.factor * hexes.vertices)


def scaled(stages: list[Stage], factors: list[float]) -> Variants:
    """All variants run in full; each replaces the factor of `meshing/optimize`."""
    options = [{"meshing/optimize": {"factor": factor}} for factor in factors]
    found = Variants(stages, options, START, BySize())
    for number in range(len(options)):
        found.run(number)
    return found


def test_the_best_mesh_is_taken_and_equal_stages_run_once():
    stages = [Stage("meshing/smooth", Scale(2.0)), Stage("meshing/optimize", Scale(3.0))]
    end, path = scaled(stages, [3.0, 5.0, 3.0]).finish()
    assert size(end) == 10
    assert [mesh.vertices.max() for mesh in path] == [2, 10]
    assert CALLS == [2.0, 3.0, 5.0]
    assert size(START) == 1


def test_a_kind_that_runs_once_runs_on_the_best():
    stages = [Stage("meshing/optimize", Scale(1.0)), Stage("meshing/refine", Scale(7.0))]
    end, path = scaled(stages, [2.0, 5.0, 3.0]).finish()
    assert CALLS == [2.0, 5.0, 3.0, 7.0]
    assert [mesh.vertices.max() for mesh in path] == [5, 35]
    assert size(end) == 35


def test_a_variant_that_fails_is_passed_over_unless_all_do():
    stages = [Stage("meshing/optimize", Scale(1.0))]
    assert size(scaled(stages, [np.inf, 2.0]).finish()[0]) == 2
    with pytest.raises(MeshingError, match="factor inf"):
        scaled(stages, [np.inf]).finish()


@dataclass(frozen=True)
class Place:
    at: float = 1.0

    def __call__(self, *_: object) -> RoughMap:
        axes = [np.array([0.0, 1.0])] * 3
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return RoughMap(*axes, self.at * grid)


@dataclass(frozen=True)
class Fill:
    def __call__(
        self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap, blocks: None
    ) -> HexMesh:
        CALLS.append(rough_map.positions.max())
        return cube(rough_map.positions.max())


def test_a_variant_of_the_map_gets_hexes_of_its_own():
    stages = [Stage("meshing/map", Place()), Stage("meshing/subdivide", Fill())]
    options = [{"meshing/map": {"at": at}} for at in (1.0, 4.0, 2.0)]
    start = RunState(TETRAHEDRON, labels=Labels([0] * 4, [0] * 4))
    found = Variants(stages, options, start, BySize())
    for number in range(3):
        found.run(number)
    assert size(found.finish()[0]) == 4
    assert CALLS == [1.0, 4.0, 2.0]


@pytest.mark.parametrize(("first", "large", "runs"), [(-1.0, 0, 1), (1.0, 0, 3), (-1.0, 9, 3)])
def test_large_meshes_with_inverted_hexes_have_no_other_variants(monkeypatch, first, large, runs):
    monkeypatch.setattr("polycube.pipeline.variants.LARGE", large)
    options = [{"meshing/optimize": {"to": to}} for to in (first, 0.2)]
    found = Variants([Stage("meshing/optimize", Grow())], options, START, BySize(), trial=TRIAL)
    found.run(0)
    found.run_others()
    assert len(CALLS) == runs
    assert found.is_hopeless == (runs == 1)


@dataclass(frozen=True)
class Cross:
    """Makes two cubes that cross each other, or one."""

    crosses: bool = True

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        CALLS.append(self.crosses)
        one = cube()
        if not self.crosses:
            return one
        corners = np.concatenate([one.vertices, one.vertices + 0.4])
        return hex_mesh(corners, np.concatenate([one.hexes, one.hexes + len(one.vertices)]))


@pytest.mark.parametrize(("gives_up", "many", "runs"), [(True, 2, 1), (False, 2, 2), (True, 99, 2)])
def test_meshes_that_cross_themselves_in_many_places_end_the_variants(
    monkeypatch, gives_up, many, runs
):
    monkeypatch.setattr("polycube.pipeline.variants.MOST_CROSSINGS", many)
    options = [{"meshing/optimize": {"crosses": crosses}} for crosses in (True, False)]
    trial = {"meshing/optimize": {}}
    stages = [Stage("meshing/optimize", Cross())]
    found = Variants(stages, options, START, BySize(good=9.0), trial=trial, gives_up=gives_up)
    found.run(0)
    found.run_others()
    assert CALLS == [True, False][:runs]
    assert found.is_hopeless == (runs == 1)


@pytest.mark.parametrize("where", ["variants", "trial"])
def test_variants_of_another_plugin_are_refused(where):
    odd = {"meshing/optimize": {"features": False, "factor": 2.0}}
    variants, trial = ([{}, odd], {}) if where == "variants" else ([{}], odd)
    stages = [Stage("meshing/optimize", Scale(3.0))]
    with pytest.raises(InputError, match=r"sets features of meshing/optimize, which Scale does"):
        Variants(stages, variants, START, BySize(), trial=trial)
