"""Structures are stored at the start of a run, and again if the search changes them."""

import shutil
from dataclasses import replace

import numpy as np

from polycube.config import compose
from polycube.pipeline.resume.results import load
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.state import RunState
from tests.fixtures.polycubes import part


def test_structures_are_stored_again_only_if_they_changed(tmp_path):
    surface = part(("cube", "cube"), np.eye(3))
    settings = Settings.of(compose("infer", ["mesh=example:rod"]))
    run, stored = Run(settings, lambda settings, clock: RunState(surface)), []
    run.results.folder = tmp_path
    state = RunState(surface)
    for each in (state, replace(state), replace(state, chosen=1), replace(state, chosen=1)):
        shutil.rmtree(tmp_path / "stages", ignore_errors=True)
        run.store_start(each)
        stored.append([load(path) for path in tmp_path.rglob("structure.npz")])
    assert stored == [[[(), 0]], [], [[(), 1]], []]
