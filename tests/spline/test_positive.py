from dataclasses import replace

import numpy as np

from polycube.spline.bezier import scaled_detj
from polycube.spline.positive import DAMPED, DAMPINGS, damped, shares
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
