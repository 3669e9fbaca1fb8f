"""Results of stages are stored and loaded, and changed settings are listed."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from polycube.errors import InputError
from polycube.pipeline.resume.results import has_stage, load, load_stage, save, save_stage
from polycube.types import HexMesh, Spline
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.stages import cube


def test_stage_results_are_stored_and_loaded(tmp_path):
    save_stage(tmp_path, "meshing/smooth", cube(2.0))
    loaded = load_stage(tmp_path, "meshing/smooth")
    assert isinstance(loaded, HexMesh)
    assert np.array_equal(loaded.vertices, cube(2.0).vertices)
    assert has_stage(tmp_path, "meshing/smooth") and not has_stage(tmp_path, "spline")
    with pytest.raises(
        InputError, match=r"no result of stage 'spline'; it contains meshing/smooth"
    ):
        load_stage(tmp_path, "spline")


def test_artifacts_store_every_kind_of_value(tmp_path):
    extraction = csr_matrix(np.eye(3)[[0, 1, 1]])
    spline = Spline(np.eye(3), extraction, np.zeros((1, 64)), [0], [1], [[0, 5]], [3], 4)
    value = [spline, ("cube", None), {"a": 1.5}, np.arange(3)]
    save(tmp_path / "value.npz", value)
    loaded = load(tmp_path / "value.npz")
    assert (loaded[0].extraction != extraction).nnz == 0
    assert loaded[0].extraordinary_edges == 4
    assert loaded[1] == ("cube", None) and loaded[2] == {"a": 1.5}
    assert (loaded[3] == np.arange(3)).all()


@pytest.mark.parametrize("kind", [np.int64, np.int32, np.int8, np.uint8, np.uint64])
@pytest.mark.parametrize("shape", [(0,), (0, 8), (1,), (300,), (40, 8), (5, 4, 3)])
def test_integers_are_stored_exactly(tmp_path, kind, shape):
    ends = np.iinfo(kind)
    value = np.random.default_rng(0).integers(ends.min, ends.max, shape, kind, endpoint=True)
    save(tmp_path / "value.npz", [value, kind(7)])
    loaded, seven = load(tmp_path / "value.npz")
    assert loaded.dtype == kind and np.array_equal(loaded, value) and loaded.shape == shape
    assert seven == 7


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("shape", [(), (0,), (0, 3), (7,), (40, 3), (5, 4, 3)])
def test_real_numbers_are_stored_exactly(tmp_path, kind, shape):
    value = np.random.default_rng(0).standard_normal(shape).astype(kind)
    value = np.asfortranarray(value)
    odd = np.array([np.nan, -0.0, np.inf, np.finfo(kind).tiny / 8], kind)
    save(tmp_path / "value.npz", [value, odd])
    for found, given in zip(load(tmp_path / "value.npz"), (value, odd), strict=True):
        assert found.dtype == kind and found.shape == given.shape
        assert found.tobytes() == given.tobytes()
        found[...] = 0  # it may be written to, as any array


def test_smooth_numbers_compress(tmp_path):
    values = np.linspace(1, 2, 10_000) ** 3
    np.savez_compressed(tmp_path / "plain.npz", values)
    save(tmp_path / "value.npz", values)
    plain, ours = ((tmp_path / name).stat().st_size for name in ("plain.npz", "value.npz"))
    assert ours < 0.9 * plain


def test_a_mesh_takes_few_bytes(tmp_path):
    mesh = hex_box((20, 20, 20))
    save(tmp_path / "value.npz", mesh.hexes)
    assert (tmp_path / "value.npz").stat().st_size < 1 * len(mesh.hexes)  # 64 as they are
