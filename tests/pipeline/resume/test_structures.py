"""Structures are stored at the start of a run, and again if the search changes them."""

from dataclasses import replace

import numpy as np

from polycube.config import compose
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.state import RunState
from tests.fixtures.polycubes import part


def test_structures_are_stored_again_only_if_they_changed(tmp_path, monkeypatch):
    surface = part(("cube", "cube"), np.eye(3))
    settings = Settings.of(compose("infer", ["mesh=example:rod"]))
    run, stored = Run(settings, lambda settings, clock: RunState(surface)), []
    monkeypatch.setattr(
        "polycube.pipeline.resume.results.save_stage", lambda *what: stored.append(what[2])
    )
    run.results.folder = tmp_path
    state = RunState(surface)
    for each in (state, replace(state), replace(state, chosen=1), replace(state, chosen=1)):
        run.store_start(each)
    assert stored == [[(), 0], [(), 1]]
