from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import random as random_matrix

from polycube.spline.bezier import scaled_detj
from polycube.spline.matching import Matches
from polycube.spline.positive import DAMPED, DAMPINGS, TANGENTIAL, _gaps, damped, shares
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from tests.fixtures.hexmeshes import hex_box


def test_damping_evaluates_only_changed_elements():
    mesh = hex_box((4, 4, 4))
    spline = volumetric_spline(mesh, single_hex_edges(mesh))
    moved = spline.control + np.random.default_rng(0).uniform(-0.12, 0.12, spline.control.shape)
    share, floor = shares(spline), np.full(64, 0.5)
    factor = np.ones(len(moved))
    for number in range(DAMPINGS):  # all elements each time
        expected = spline.control + factor[:, None] * (moved - spline.control)
        low = scaled_detj(replace(spline, control=expected)) < floor
        if not low.any():
            break
        influence = np.minimum(3 * share.toarray()[low].max(axis=0), 1)
        factor *= (DAMPED if number < DAMPINGS - 1 else 0) ** influence
    assert 1 < number
    assert (damped(spline, moved, floor, share) == expected).all()


def test_gaps_along_the_normal_have_the_largest_weight():
    number = 50
    rng = np.random.default_rng(0)
    rows = random_matrix(number, 40, 0.1, "csr", rng=rng)
    normal = rng.standard_normal((number, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    matches = Matches(rows, rng.standard_normal((number, 3)), normal, rng.uniform(size=number))
    control, moves = rng.standard_normal((40, 3)), np.arange(0, 40, 2)
    chosen = np.arange(0, number, 3)

    def reference(y):
        all_of = control.copy()
        all_of[moves] = y
        gap = (rows @ all_of - matches.goal)[chosen]
        square = (gap * normal[chosen]).sum(axis=1) ** 2 + TANGENTIAL * (gap**2).sum(axis=1)
        return matches.weight[chosen] @ square

    y, step = rng.standard_normal((2, len(moves), 3))
    value, slope = _gaps(control, moves, matches, chosen)(y)
    assert value == pytest.approx(reference(y), rel=1e-12)
    ahead, behind = reference(y + step), reference(y - step)  # exact, because it is quadratic
    assert np.vdot(slope, step) == pytest.approx((ahead - behind) / 2, rel=1e-10)
