from dataclasses import replace

import numpy as np
import pytest

from polycube.io.hex_meshes import boundary
from polycube.spline.matching import Matcher
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from polycube.surface.fit_target import target
from tests.fixtures.hexmeshes import hex_box


def test_matches_do_not_depend_on_earlier_positions():
    mesh = hex_box((3, 4, 5), (2.0, 1.5, 0.7))
    goal = target(boundary(mesh))
    spline = volumetric_spline(mesh, single_hex_edges(mesh))
    spline = replace(spline, control=goal.to_unit(spline.control))
    shift = np.random.default_rng(0).uniform(-0.02, 0.02, spline.control.shape)
    used = Matcher(spline, goal, np.zeros(len(spline.sides), np.int64))
    used(spline.control)
    again, fresh = (
        matcher(spline.control + shift)
        for matcher in (used, Matcher(spline, goal, np.zeros(len(spline.sides), np.int64)))
    )
    assert abs(again.rows - fresh.rows).max() < 1e-12
    for mine, other in zip(again[1:], fresh[1:], strict=True):
        assert mine == pytest.approx(other, abs=1e-12)
