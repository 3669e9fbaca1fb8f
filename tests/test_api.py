"""The program from Python."""

import logging
import signal
import sys
import threading
from types import SimpleNamespace

import numpy as np
import pytest

import polycube
from polycube.errors import InputError, MeshingError
from polycube.examples.parts import example
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.hex_meshes import read_hexes
from polycube.types import TriMesh
from tests.fixtures.surfaces import box

FAST = {"size": "12%", "structure": "slices"}
BLOCK = box()
SIDES = TriMesh(BLOCK.vertices, BLOCK.faces, np.arange(12) // 2 + 1, tuple("ABCDEF"))


@pytest.mark.slow
def test_from_an_array_to_modes(capfd):
    given = example("dice")
    surface = SimpleNamespace(vertices=given.vertices + 100.0, faces=given.faces)
    part = polycube.mesh(surface, analysis={"modes": 8}, **FAST)
    np.testing.assert_array_equal(part.surface.vertices, surface.vertices)
    worst = scaled_jacobian(part.hexes.vertices, part.hexes.hexes).min()
    assert worst == pytest.approx(part.report["hex"]["min_scaled_jacobian"])
    assert len(part.spline.nodes) >= len(part.hexes.hexes)
    assert len(part.modes.frequency) == 8 and part.modes.frequency[7] > 0
    assert part.polycube.context == tuple(part.report["polycube"]["context"])
    assert capfd.readouterr().err == ""


@pytest.mark.slow
def test_faces_of_a_cad_model_survive():
    part = polycube.mesh(SIDES, order=["meshing"], **FAST)
    assert {f"cad_{name}" for name in "ABCDEF"} <= set(part.hexes.sets)
    assert np.array_equal(part.surface.region, SIDES.region)


@pytest.mark.slow
def test_what_is_not_asked_for_is_none_and_files_are_kept_on_request(tmp_path):
    part = polycube.mesh("example:dice", "order=[meshing]", output_dir=tmp_path, **FAST)
    assert part.spline is None and part.modes is None
    written, _ = read_hexes(str(tmp_path / "hex.vtu"))
    assert len(written.hexes) == len(part.hexes.hexes)
    improved = polycube.mesh(tmp_path / "hex.vtu", order=["meshing"])  # a hex mesh is improved
    same = polycube.mesh(part.hexes, order=["meshing"])
    assert improved.polycube is None and same.polycube is None
    before, after = (p.report["hex"]["min_scaled_jacobian"] for p in (part, improved))
    assert after > before - 0.05


@pytest.mark.slow
def test_the_mesh_is_saved_by_its_suffix(tmp_path):
    part = polycube.mesh(SIDES, order=["meshing"], **FAST)
    assert part.save(tmp_path / "part.inp") == tmp_path / "part.inp"
    assert len(read_hexes(str(tmp_path / "part.inp"))[0].hexes) == len(part.hexes.hexes)
    assert "*FREQUENCY\n20\n" in (tmp_path / "part.inp").read_text()  # the analysis by default
    with pytest.raises(InputError, match=r"no format has this suffix; choose one of \.bdf.*vtu"):
        part.save(tmp_path / "part.step")


@pytest.mark.slow
def test_the_mesh_and_the_solution_as_grids_of_pyvista(tmp_path):
    part = polycube.mesh(SIDES, analysis={"modes": 7}, **FAST)
    grid = part.to_pyvista()
    np.testing.assert_array_equal(grid.points, part.hexes.vertices)
    np.testing.assert_array_equal(grid.cells_dict[12], part.hexes.hexes)
    assert grid.point_data["z_max"].sum() == len(
        np.unique(part.hexes.quads[part.hexes.sets["z_max"]])
    )
    assert grid["scaled_jacobian"].min() == part.report["hex"]["min_scaled_jacobian"]
    modes = part.to_pyvista("solution")
    assert sum(name.startswith("mode_") for name in modes.array_names) == 7
    assert part.save(tmp_path / "part.vtu").is_file()
    only = polycube.mesh(SIDES, order="meshing", **FAST)
    with pytest.raises(InputError, match="nothing called 'solution'"):
        only.to_pyvista("solution")


@pytest.mark.parametrize(
    ("source", "options", "sentence"),
    [
        ("none.stl", {"seed": 1}, "none.stl: there is no such file"),
        ("example:dice", {"seed": -1}, "seed must be a whole number"),
        ("example:dice", {"nothing": 1}, "nothing"),
        ("example:dice", {"structure": "magic"}, "magic"),
        (3, {}, "a part must be a path, a mesh or an object with vertices and faces; got int"),
        (TriMesh(BLOCK.vertices, BLOCK.faces[:-1]), {}, "not closed"),
    ],
)
def test_refusals_are_one_line(source, options, sentence):
    with pytest.raises(InputError, match=sentence) as refused:
        polycube.mesh(source, **options)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_a_failure_carries_what_was_made():
    with pytest.raises(MeshingError, match=r"it must be 1 or more") as failed:
        polycube.mesh("example:dice", order=["meshing"], acceptance={"least_jacobian": 1}, **FAST)
    assert len(failed.value.result.hexes.hexes) > 0
    assert not failed.value.result.report["valid"]


def test_an_error_has_its_parts():
    error = InputError("the surface is open", where="part.stl", remedy="say repair=safe")
    assert str(error) == "part.stl: the surface is open; say repair=safe"
    assert (error.what, error.where, error.remedy)[0] == "the surface is open"
    assert str(InputError("plain")) == "plain"


@pytest.mark.slow
def test_nothing_of_the_process_is_changed_and_threads_work():
    def facts() -> tuple:
        log = logging.getLogger("polycube")
        return (
            sys.getswitchinterval(),
            signal.getsignal(signal.SIGTERM),
            signal.getsignal(signal.SIGINT),
            log.level,
            list(log.handlers),
            list(logging.getLogger().handlers),
        )

    before, made = facts(), []
    threads = [
        threading.Thread(
            target=lambda: made.append(polycube.mesh(SIDES, order=["meshing"], **FAST))
        )
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert facts() == before
    one, other = made
    assert np.array_equal(one.hexes.vertices, other.hexes.vertices)


def test_other_names_are_missing_and_these_are_listed():
    assert dir(polycube) == sorted([*polycube.__all__, "__version__"])
    assert all(getattr(polycube, name).__doc__ for name in polycube.__all__)
    with pytest.raises(AttributeError, match=r"no attribute 'nonsense'$"):
        polycube.nonsense  # noqa: B018
    with pytest.raises(AttributeError, match=r"did you mean mesh$"):
        polycube.mseh  # noqa: B018


@pytest.mark.slow
def test_a_misspelt_option_is_refused_as_on_the_command_line():
    for given in ({"meshing.sise": 3}, {"meshing": {"sise": 3}}):
        with pytest.raises(
            InputError, match=r"no option meshing\.sise; did you mean meshing\.size"
        ):
            polycube.mesh("example:dice", **given)
    with pytest.raises(InputError, match=r"no option siz; did you mean size"):
        polycube.mesh("example:dice", siz=3)
