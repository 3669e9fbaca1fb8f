from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import random as random_matrix

from polycube.spline.bezier import scaled_detj
from polycube.spline.matching import Matches
from polycube.spline.positive import DAMPED, DAMPINGS, TANGENTIAL, _Gap, damped, shares
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from tests.fixtures.hexmeshes import hex_box


def test_damping_looks_again_only_where_something_changed():
    mesh = hex_box((4, 4, 4))
    spline = volumetric_spline(mesh, single_hex_edges(mesh))
    moved = spline.control + np.random.default_rng(0).uniform(-0.12, 0.12, spline.control.shape)
    share, floor = shares(spline), np.full(64, 0.5)
    kept = np.ones(len(moved))
    for number in range(DAMPINGS):  # all elements each time
        expected = spline.control + kept[:, None] * (moved - spline.control)
        low = scaled_detj(replace(spline, control=expected)) < floor
        if not low.any():
            break
        felt = np.minimum(3 * share.toarray()[low].max(axis=0), 1)
        kept *= (DAMPED if number < DAMPINGS - 1 else 0) ** felt
    assert 1 < number
    assert (damped(spline, moved, floor, share) == expected).all()


def test_gaps_weigh_most_along_their_normals():
    number = 50
    rng = np.random.default_rng(0)
    rows = random_matrix(number, 40, 0.1, "csr", rng=rng)
    normal = rng.standard_normal((number, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    matches = Matches(rows, rng.standard_normal((number, 3)), normal, rng.uniform(size=number))
    control, moves = rng.standard_normal((40, 3)), np.arange(0, 40, 2)
    felt = np.arange(0, number, 3)

    def slow(y):
        all_of = control.copy()
        all_of[moves] = y
        gap = (rows @ all_of - matches.goal)[felt]
        square = (gap * normal[felt]).sum(axis=1) ** 2 + TANGENTIAL * (gap**2).sum(axis=1)
        return matches.weight[felt] @ square

    y, way = rng.standard_normal((2, len(moves), 3))
    value, slope = _Gap(control, moves, matches, felt)(y)
    assert value == pytest.approx(slow(y), rel=1e-12)
    ahead, behind = slow(y + way), slow(y - way)  # exact, for it is quadratic
    assert np.vdot(slope, way) == pytest.approx((ahead - behind) / 2, rel=1e-10)
