"""The Python interface under stress: any arrays, threads, other programs, poor environments."""

import gc
import os
import pickle
import resource
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import polycube
from polycube import HOME
from tests.fixtures.surfaces import box

OPTIONS = {"size": "25%", "structure": "slices", "order": ["meshing"]}
BLOCK = box(high=(1, 2, 3))
CALL = """
import polycube
part = polycube.mesh("example:rod", size="20%", structure="slices", order=["meshing"])
print(len(part.hexes.hexes))
"""
PROGRAM = """
import hydra
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
import polycube

@hydra.main(version_base=None, config_path="conf", config_name="mine")
def main(config):
    before = GlobalHydra.instance().hydra
    part = polycube.mesh("example:rod", size=config.size, structure="slices", order=["meshing"])
    assert GlobalHydra.instance().hydra is before
    assert HydraConfig.get().job.config_name == "mine"
    print(len(part.hexes.hexes))

main()
"""
UNPRIVILEGED = ("setpriv", "--bounding-set=-dac_override,-dac_read_search", "--inh-caps=-all")


def strided(values):
    wide = np.zeros((2 * len(values), 5), values.dtype)
    wide[::2, 1:4] = values
    return wide[::2, 1:4]


def read_only(values):
    values = values.copy()
    values.flags.writeable = False
    return values


@pytest.fixture(scope="module")
def part():
    return polycube.mesh(BLOCK, **OPTIONS)


@pytest.mark.slow
@pytest.mark.parametrize("change", [strided, read_only, np.asfortranarray, lambda v: v.tolist()])
def test_any_arrays_give_the_same_bits_and_are_not_changed(part, change):
    vertices, faces = change(BLOCK.vertices.astype("f4")), change(BLOCK.faces.astype("u2"))
    found = polycube.mesh(SimpleNamespace(vertices=vertices, faces=faces), **OPTIONS)
    assert np.array_equal(found.hexes.vertices, part.hexes.vertices)
    assert np.array_equal(found.hexes.hexes, part.hexes.hexes)
    assert np.array_equal(vertices, BLOCK.vertices) and np.array_equal(faces, BLOCK.faces)


@pytest.mark.slow
def test_results_do_not_share_the_arrays_of_the_input(part):
    given = SimpleNamespace(vertices=BLOCK.vertices.copy(), faces=BLOCK.faces.copy())
    found = polycube.mesh(given, **OPTIONS)
    given.vertices[:], given.faces[:] = np.nan, 0
    assert np.array_equal(found.surface.vertices, part.surface.vertices)
    assert np.array_equal(found.surface.faces, part.surface.faces)


def test_a_result_is_pickled(part, tmp_path):
    found = pickle.loads(pickle.dumps(part))
    assert np.array_equal(found.hexes.vertices, part.hexes.vertices)
    assert found.report == part.report and found.polycube.context == part.polycube.context
    found.save(tmp_path / "part.vtu")
    assert (tmp_path / "part.vtu").stat().st_size > 1000


@pytest.mark.slow
def test_threads_do_not_disturb_each_other(part):
    surfaces = [BLOCK, box(high=(1, 1, 1)), box(high=(3, 1, 1)), BLOCK]
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(lambda each: polycube.mesh(each, **OPTIONS), surfaces))
    for surface, found in zip(surfaces, together, strict=True):
        alone = polycube.mesh(surface, **OPTIONS)
        assert np.array_equal(found.hexes.vertices, alone.hexes.vertices)


@pytest.mark.slow
def test_many_calls_do_not_need_more_memory():
    def used() -> float:  # MB, now
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 1e6

    for _ in range(10):
        polycube.mesh(BLOCK, **OPTIONS)
    before = used()
    for _ in range(40):
        polycube.mesh(BLOCK, **OPTIONS)
    assert used() - before < 20


@pytest.mark.slow
def test_inside_another_program_of_hydra(tmp_path):
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf/mine.yaml").write_text("size: 20%\n")
    (tmp_path / "program.py").write_text(PROGRAM)
    assert hexes(["program.py"], tmp_path) > 100


@pytest.mark.slow
def test_without_warnings_and_without_an_environment(tmp_path):
    bare = {"PATH": os.environ["PATH"], "TMPDIR": str(tmp_path / "missing")}
    assert hexes(["-W", "error", "-c", CALL], tmp_path, environment=bare) > 100


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("setpriv"), reason="needs setpriv")
def test_an_installation_and_a_home_that_cannot_be_written(tmp_path):
    install, home = tmp_path / "install", tmp_path / "home"
    for name in ("polycube", "plugins", "conf"):
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(HOME / name, install / name, ignore=ignore)
    home.mkdir()
    folders = [home, *(each for each in install.rglob("*") if each.is_dir()), install]
    for folder in folders:
        folder.chmod(0o555)
    prefix = UNPRIVILEGED if os.getuid() == 0 else ()
    environment = {"PATH": os.environ["PATH"], "HOME": str(home), "TMPDIR": str(tmp_path)}
    try:
        found = hexes(["-c", CALL], tmp_path, install, environment, prefix)
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert found > 100
    assert not list(home.iterdir()) and not list(install.rglob("__pycache__"))
    assert not list(tmp_path.glob("polycube-*"))


def hexes(arguments, folder, package=HOME, environment=None, prefix=()):
    """The number that a program in a folder prints last."""
    environment = {**(environment or os.environ), "PYTHONPATH": str(package)}
    command = [*prefix, sys.executable, *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return int(done.stdout.split()[-1])
