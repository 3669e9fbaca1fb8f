"""Where no fitted mesh is valid, hexes of a lattice are, fitted as far as they stay so."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.errors import MeshingError
from polycube.fitting.partial import is_sound
from polycube.hexmesh.connectivity import genus
from polycube.io.stl import write_stl
from polycube.pipeline.choices import choose, spares_of, structures_to_mesh
from polycube.pipeline.guarantee import in_order, is_usable, last_attempt, wrong_topology
from polycube.stages import Stage
from polycube.state import RunState
from polycube.pipeline.variants import Variants
from polycube.plugins.acceptance.standard import Standard
from polycube.registry import build
from polycube.types import HexMesh, TriMesh
from tests.fixtures.polycubes import PRIMITIVES
from tests.fixtures.runs import run
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
    made = build("structure", config, grid=(1, 1, 1), primitives=PRIMITIVES)(surface, ())
    entries = build("ranking", {"plugin": "registration"})(surface, made)
    return choose(RunState(surface, ranked=entries), 0, PRIMITIVES)


def variants(state: RunState, *stages: Stage) -> Variants:
    subdivide = build("meshing/subdivide", {"plugin": "template", "level": 0})
    return Variants([Stage("meshing/subdivide", subdivide), *stages], [], state, Standard())


@pytest.fixture(scope="module")
def ring() -> RunState:
    return ranked(torus(), finer=[1.0], finest=1.0)


def test_a_mesh_that_the_stages_fold_is_fitted_in_part(ring):
    start = variants(ring, Stage("meshing/smooth", Fold()), Stage("meshing/optimize", Fail()))
    folded = variants(ring, Stage("meshing/smooth", Fold()))
    assert not is_usable(start)
    folded.run(0)
    assert folded.attempts and not is_usable(folded)
    end = last_attempt([start], "it is folded")
    assert is_sound(end.hexes) and genus(end.hexes) == 1
    assert end.unfitted.startswith("no fitted mesh is valid (it is folded); this one is only pa")
    assert "of the diagonal at [" in end.unfitted and "99 % of the points" in end.unfitted
    assert wrong_topology(end) == ""


def test_one_that_lies_on_the_surface_in_the_end_is_as_any_other():
    names = {"meshing/smooth": "register", "meshing/optimize": "polish"}
    stages = [Stage(kind, build(kind, {"plugin": name})) for kind, name in names.items()]
    start = variants(ranked(torus(), finer=[2.0]), *stages)
    end = last_attempt([start], "it is folded")
    assert end.unfitted is None
    assert Standard()(end.hexes, end.surface).is_valid


def test_a_structure_without_valid_hexes_gives_its_place_to_the_next(ring):
    coarse = replace(ring, ranked=())
    mirrored = replace(ring.rough_map, positions=ring.rough_map.positions * [-1, 1, 1])
    folded = variants(replace(coarse, rough_map=mirrored))
    failing = variants(coarse)
    failing.stages = [Stage("meshing/smooth", Fail())]
    assert last_attempt([folded, failing], "why") is None
    end = last_attempt([folded, variants(coarse)], "why")
    assert is_sound(end.hexes)


def test_overlays_come_first_and_the_finest_before_others(ring):
    one, two = variants(ring), variants(ring)
    coarse = variants(replace(ring, ranked=()))
    assert in_order([coarse, one, two], coarse) == [two, one, coarse]
    assert in_order([one, two], one) == [two, one]


def test_why_there_is_no_valid_mesh_is_that_of_the_best_or_of_the_failures(ring):
    failing = variants(ring, Stage("meshing/smooth", Fail()))
    failing.run(0)
    assert failing.reason == "it cannot be"
    folded = variants(ring, Stage("meshing/smooth", Fold()))
    folded.run(0)
    assert "smallest scaled Jacobian is -" in folded.reason


def test_a_lattice_of_another_genus_is_meshed_only_where_there_is_nothing_else(ring):
    spare = ranked(torus(), size="40%", **OTHER)
    assert [each.candidate.family for each in spare.ranked] == ["spare"]
    assert structures_to_mesh(spare.ranked, 2) == [0]
    both = [*ring.ranked, *spare.ranked]
    assert structures_to_mesh(both, 2) == [0] and spares_of(both) == [1]
    end = last_attempt([variants(spare)], "why")
    assert wrong_topology(end).startswith("the topology differs: the mesh has genus 0, the part 1")


def test_a_part_without_a_lattice_of_its_genus_has_a_mesh_that_says_so(tmp_path):
    surface = torus()
    write_stl(tmp_path / "ring.stl", surface.vertices, surface.faces)
    report = run(
        f"mesh={tmp_path / 'ring.stl'}",
        f"output_dir={tmp_path / 'out'}",
        "order=[meshing]",
        "structure=overlay",
        "meshing.size=40%",
        *(f"structure.{name}={value}" for name, value in OTHER.items()),
    )
    assert not report["valid"] and "the topology differs" in report["failure"]
    assert report["hex"]["min_scaled_jacobian"] > 0
