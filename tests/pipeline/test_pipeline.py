"""The chain check, the clock and the artifacts, on small made-up stages."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from polycube.errors import InputError, MeshingError
from polycube.io import artifacts
from polycube.kinds import check_chain
from polycube.numerics.lbfgs import descend
from polycube.pipeline.stages import Clock, load_stage, save_stage
from polycube.types import HexMesh, Spline

CUBE = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T[:, ::-1]


def cube(scale: float = 1.0) -> HexMesh:
    corners = [[0, 1, 3, 2, 4, 5, 7, 6]]
    return HexMesh(scale * CUBE, corners, np.zeros((0, 4)), np.zeros(0), [0])


def test_a_stage_without_its_input_is_named_with_the_remedy():
    with pytest.raises(InputError, match=r"'meshing/smooth' needs hexes.*put meshing/subdivide"):
        check_chain(["meshing/smooth"], {"surface"})


def test_a_stage_that_is_none_is_named():
    with pytest.raises(InputError, match="'schedule' is no stage; the stages are structure"):
        check_chain(["schedule"], {"surface"})


def test_the_natural_order_is_a_chain():
    order = ["meshing/segment", "meshing/subdivide", "meshing/smooth", "meshing/pillow"]
    have = {"surface", "polycube", "rough_map", "parametrization"}
    check_chain([*order, "meshing/optimize", "spline", "analysis"], have)


def test_a_stage_that_breaks_is_named():
    def broken() -> None:
        raise ZeroDivisionError("by zero")

    with pytest.raises(MeshingError, match="stage meshing/smooth failed: ZeroDivisionError"):
        Clock().run("meshing/smooth", broken)


def test_the_clock_sums_the_effort_of_repeats():
    def bowl() -> np.ndarray:
        return descend(lambda x: (float(x @ x), 2 * x), np.ones(2), 1)

    clock = Clock()
    for name in ("meshing/smooth", "meshing/optimize", "meshing/smooth"):
        clock.run(name, bowl)
    clock.run("spline", lambda: None)
    once = {"steps": 1, "evaluations": 2}
    twice = {"steps": 2, "evaluations": 4}
    assert clock.effort == {"meshing/smooth": twice, "meshing/optimize": once, "spline": {}}
    assert set(clock.seconds) == set(clock.effort)


def test_stage_results_come_back(tmp_path):
    save_stage(tmp_path, "meshing/smooth", cube(2.0))
    back = load_stage(tmp_path, "meshing/smooth")
    assert isinstance(back, HexMesh)
    assert (back.vertices == 2.0 * CUBE).all()
    with pytest.raises(InputError, match=r"no result of stage 'spline'; it holds meshing/smooth"):
        load_stage(tmp_path, "spline")


def test_artifacts_keep_every_kind_of_value(tmp_path):
    extraction = csr_matrix(np.eye(3)[[0, 1, 1]])
    spline = Spline(np.eye(3), extraction, np.zeros((1, 64)), [0], [1], [[0, 5]], [3], 4)
    value = [spline, ("cube", None), {"a": 1.5}, np.arange(3)]
    artifacts.save(tmp_path / "value.npz", value)
    back = artifacts.load(tmp_path / "value.npz")
    assert (back[0].extraction != extraction).nnz == 0
    assert back[0].extraordinary_edges == 4
    assert back[1] == ("cube", None) and back[2] == {"a": 1.5}
    assert (back[3] == np.arange(3)).all()
