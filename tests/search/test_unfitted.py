"""If no fitted mesh is valid, hexes of a lattice are fitted as far as they stay valid."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.errors import MeshingError
from polycube.fitting.uncrossing import is_sound
from polycube.hexmesh.connectivity import genus
from polycube.io.stl import write_stl
from polycube.plugins.acceptance.standard import Standard
from polycube.registry import build
from polycube.search.chain import Chain
from polycube.search.history import History, choose
from polycube.search.moves import FitPartly, MeshStructure, possible
from polycube.search.unfitted import partly_fitted_state, wrong_topology
from polycube.stages import Stage
from polycube.state import RunState
from polycube.types import HexMesh, Tier, TriMesh
from tests.fixtures.polycubes import PRIMITIVES
from tests.fixtures.runs import run
from tests.fixtures.stages import history, made
from tests.fixtures.surfaces import torus

# cells as large as the hole
OTHER = {"finer": [1.0], "finest": 1.0, "steps": [1.0], "least": [0.3], "thin": []}


@dataclass(frozen=True)
class Fold:
    """Moves the half of the mesh at x > 0 through the other one, and the rest a little."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        x, y, z = hexes.vertices.T
        return replace(hexes, vertices=np.stack([np.where(x > 0, -2 * x, x), y, 1.01 * z], axis=1))


@dataclass(frozen=True)
class Fail:
    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        raise MeshingError("it cannot be")


def ranked(surface: TriMesh, **options) -> RunState:
    """A state with the overlays of a surface as its structures."""
    config = {"plugin": "overlay", "size": "10%", **options}
    found = build("structure", config, grid=(1, 1, 1), primitives=PRIMITIVES)(surface, ())
    entries = build("ranking", {"plugin": "registration"})(surface, found)
    return choose(RunState(surface, ranked=entries), 0, PRIMITIVES)


def searching(state: RunState, *stages: Stage) -> History:
    """A search that does not refuse meshes with many crossings."""
    subdivide = build("meshing/subdivide", {"plugin": "template", "level": 0})
    return history(
        [Stage("meshing/subdivide", subdivide), *stages],
        start=state,
        acceptance=Standard(),
        ranked=state.ranked,
        primitives=PRIMITIVES,
        chain=Chain(most_crossings=np.inf),
    )


@pytest.fixture(scope="module")
def ring() -> RunState:
    return ranked(torus(), finer=[1.0], finest=1.0)


def test_a_mesh_that_the_stages_fold_is_fitted_in_part(ring):
    found = searching(ring, Stage("meshing/smooth", Fold()), Stage("meshing/optimize", Fail()))
    made(found, MeshStructure(0, 0))
    assert found.leader is None and found.why_no_mesh == "it cannot be"
    [move] = set(possible(found)) - {MeshStructure(0, 0)}
    assert move == FitPartly(0)
    made(found, move)
    end = found.leader.state
    assert is_sound(end.hexes) and genus(end.hexes) == 1
    assert end.unfitted.startswith("no fitted mesh is valid (no mesh was finished); this one is ")
    assert "of the diagonal at [" in end.unfitted and "99 % of the points" in end.unfitted
    assert wrong_topology(end) == ""
    assert found.leader.verdict.failures[0] == end.unfitted


def test_a_partly_fitted_mesh_takes_the_place_of_a_folded_one_and_says_why(ring):
    found = made(searching(ring, Stage("meshing/smooth", Fold())), MeshStructure(0, 0))
    assert found.leader.key[0] == 0
    [why] = found.leader.verdict.failures[:1]
    made(found, FitPartly(0))
    assert found.leader.number == 1 and found.leader.key[0] == 1
    assert why in found.leader.state.unfitted and not found.leader.verdict.is_valid
    assert not [move for move in possible(found) if isinstance(move, FitPartly)]


@pytest.mark.slow
def test_one_that_lies_on_the_surface_in_the_end_is_as_any_other():
    names = {"meshing/smooth": "register", "meshing/optimize": "polish"}
    stages = [Stage(kind, build(kind, {"plugin": name})) for kind, name in names.items()]
    found = searching(ranked(torus(), finer=[2.0]), *stages)
    end = partly_fitted_state(found.task, found.start(0), "it is folded")
    assert end.unfitted is None
    assert Standard()(end.hexes, end.surface).is_valid


def test_a_structure_without_valid_hexes_makes_no_mesh(ring):
    coarse = replace(ring, ranked=())
    mirrored = replace(ring.rough_map, positions=ring.rough_map.positions * [-1, 1, 1])
    task = searching(coarse).task
    assert partly_fitted_state(task, replace(coarse, rough_map=mirrored), "why") is None
    failing = replace(task, fit=[Stage("meshing/smooth", Fail())])
    assert partly_fitted_state(failing, coarse, "why") is None
    assert is_sound(partly_fitted_state(task, coarse, "why").hexes)


def test_a_lattice_of_another_genus_says_so():
    spare = ranked(torus(), size="40%", **OTHER)
    assert [each.candidate.tier for each in spare.ranked] == [Tier.LAST]
    found = searching(spare)
    end = partly_fitted_state(found.task, found.start(0), "why")
    assert wrong_topology(end).startswith("the topology differs: the mesh has genus 0, the part 1")


@pytest.mark.slow
@pytest.mark.parametrize("effort", ["first", "normal"])
def test_a_part_without_a_lattice_of_its_genus_has_a_mesh_that_says_so(effort, tmp_path):
    surface = torus()
    write_stl(tmp_path / "ring.stl", surface.vertices, surface.faces)
    report = run(
        f"mesh={tmp_path / 'ring.stl'}",
        f"output_dir={tmp_path / 'out'}",
        f"effort={effort}",
        "order=[meshing]",
        "structure=overlay",
        "meshing.size=40%",
        *(f"structure.{name}={value}" for name, value in OTHER.items()),
    )
    assert not report["valid"] and "the topology differs" in report["failure"]
    assert report["hex"]["min_scaled_jacobian"] > 0
