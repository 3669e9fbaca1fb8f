"""Fixtures shared by all tests."""

import gc
import logging
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

collect_ignore = ["acme_polycube"]  # a package of its own; test_packaging runs its tests

gc.disable()  # imports make little garbage, and searching them takes a fifth of the collection


def pytest_collection_finish() -> None:
    """Collect garbage from here on, but not among what is needed until the end."""
    gc.freeze()
    gc.set_threshold(20_000)  # more of it, less often
    gc.enable()


def first_quick(number: int, cases: Iterable[object]) -> list:
    """Cases of a parametrized test: those after the first `number` are slow, and CI runs them.

    A tuple is the values of several arguments.
    """

    def marked(case: object) -> object:
        values = case if isinstance(case, tuple) else (case,)
        return pytest.param(*values, marks=pytest.mark.slow)

    cases = list(cases)
    return [*cases[:number], *map(marked, cases[number:])]


@pytest.fixture(autouse=True)
def root_log() -> Iterator[None]:
    """The root of the log as it was: Hydra's handlers write to the streams of their own test."""
    handlers, level = logging.root.handlers[:], logging.root.level
    yield
    logging.root.handlers[:] = handlers
    logging.root.setLevel(level)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the working directory during the test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def argv(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Sets the command line of this process: its program and its arguments."""

    def set_to(*words: object) -> None:
        monkeypatch.setattr(sys, "argv", list(map(str, words)))
        monkeypatch.setenv("HYDRA_FULL_ERROR", "0")  # a command sets it

    return set_to


@pytest.fixture
def own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    """A registry of plugins of our own, put back afterwards."""
    from polycube import registry

    registry.classes()
    monkeypatch.setattr(registry, "_classes", dict(registry._classes))
    monkeypatch.setattr(registry, "_broken", dict(registry._broken))


@pytest.fixture
def import_first(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], None]:
    """Puts a folder first on the module path of the processes that are started."""

    def put(folder: Path) -> None:
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), *sys.path]))

    return put


@pytest.fixture
def without_gmsh(import_first, tmp_path: Path) -> None:
    """Gmsh does not load in the processes that are started."""
    (tmp_path / "gmsh.py").write_text("raise ImportError('libGLU.so.1: no such file')")
    import_first(tmp_path)


@pytest.fixture
def on_cores(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[int], None]]:
    """Sets the number of cores that this process may use."""
    from polycube.numerics.threads import pool

    def set_to(number: int) -> None:
        cores = set(range(number))
        monkeypatch.setattr(os, "sched_getaffinity", lambda _: cores, raising=False)
        pool.cache_clear()

    yield set_to
    pool.cache_clear()


@pytest.fixture(scope="session")
def testdata() -> Path:
    """Folder of given parts: POLYCUBE_TESTDATA, else ../shared/testdata; skips when absent."""
    folder = Path(os.environ.get("POLYCUBE_TESTDATA", ROOT.parent / "shared" / "testdata"))
    if not folder.is_dir():
        pytest.skip(f"no test data in {folder}; set POLYCUBE_TESTDATA")
    return folder
