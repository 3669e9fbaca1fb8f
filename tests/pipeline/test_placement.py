"""The mesh of an identical solid, moved: all that depends on the place is as if it was meshed."""

import numpy as np
import pytest

from polycube.api import execute
from polycube.config import compose
from polycube.io.solids.motions import Motion
from polycube.pipeline.improvement import is_meshed
from polycube.pipeline.settings import Settings
from polycube.state import RunState
from tests.fixtures.runs import FAST
from tests.fixtures.surfaces import halved_box

ORDER = [f"meshing/{name}" for name in ("subdivide", "smooth", "pillow", "optimize", "refine")]
STATIC = ["order=[meshing,spline,analysis]", "analysis=static", "analysis.fixed=[y_min]"]
TO_Y = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # x goes to y
MOTION = Motion(TO_Y, np.array([5.0, 6, 7]), np.arange(7)[::-1])


def settings(*overrides):
    return Settings.of(compose("infer", ["mesh=object", *FAST, *overrides]))


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Folder and result of the run of a box of two by one by one."""
    folder = tmp_path_factory.mktemp("source")
    read = lambda settings, clock: RunState(halved_box(), path="object")  # noqa: E731
    return folder, execute(settings("order=[meshing]"), folder, read)


@pytest.fixture(scope="module")
def copy(source, tmp_path_factory):
    folder = tmp_path_factory.mktemp("copy")
    load = "analysis.loads=[{at: y_max, force: [0, 1, 0]}]"
    return folder, execute(settings(*STATIC, load), folder, placed=(source[0], MOTION))


@pytest.mark.slow
def test_mesh_and_surface_are_moved_and_cad_faces_renumbered(source, copy):
    before, after = source[1], copy[1]
    assert after.failure is None and before.failure is None
    np.testing.assert_array_equal(after.hexes.vertices, MOTION(before.hexes.vertices))
    np.testing.assert_array_equal(after.hexes.hexes, before.hexes.hexes)
    np.testing.assert_array_equal(after.surface.vertices, MOTION(before.surface.vertices))
    np.testing.assert_array_equal(after.surface.region, 8 - before.surface.region)
    for face in range(1, 8):
        own, moved = (r.hexes.sets[f"cad_face_{n}"] for r, n in ((before, face), (after, 8 - face)))
        np.testing.assert_array_equal(own, moved)


@pytest.mark.slow
def test_names_of_directions_are_those_of_the_new_place(source, copy):
    before, after = source[1].hexes.sets, copy[1].hexes.sets
    for old, new in {
        "x_min": "y_min",
        "x_max": "y_max",
        "y_min": "x_max",
        "z_min": "z_min",
    }.items():
        np.testing.assert_array_equal(before[old], after[new])


@pytest.mark.slow
def test_an_analysis_is_done_in_the_new_place(copy):
    """The bar lies along y there, and is held at one end and pulled at the other."""
    report = copy[1].report["static"]
    assert report["load"] == pytest.approx([0, 1, 0], abs=1e-9)
    [held] = report["reactions"]
    assert held["at"] == "y_min" and held["force"] == pytest.approx([0, -1, 0], abs=1e-6)


@pytest.mark.slow
def test_its_folder_is_that_of_a_run_which_can_be_resumed(copy):
    folder, result = copy
    assert is_meshed(folder, ORDER) and not is_meshed(folder / "stages", ORDER)
    overrides = (f"resume={folder}", "from=spline", "order=[meshing,spline]")
    resumed = execute(settings(*overrides), folder)
    np.testing.assert_array_equal(resumed.hexes.vertices, result.hexes.vertices)
    np.testing.assert_allclose(resumed.spline.control, result.spline.control)
