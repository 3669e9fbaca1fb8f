"""Arrows of loads: where a load acts, in its direction."""

import numpy as np
import trimesh

from polycube.registry import build
from polycube.report.pictures import loads
from tests.fixtures.splines import meshed_box


def arrows(monkeypatch, *given) -> np.ndarray:
    """Directions (N, 3) of the arrows of loads on a box of 4 x 1 x 1 mm, of length 1."""
    found = []

    def pushed(place, normal, vector, length):
        found.append(vector / np.linalg.norm(vector))
        return trimesh.Trimesh(np.eye(3), [[0, 1, 2]])

    monkeypatch.setattr(loads, "_pushed", pushed)
    mesh, _ = meshed_box((4, 2, 2), (4.0, 1.0, 1.0))
    analysis = {"plugin": "static", "units": "mm", "gravity": [0, 0, 0], "loads": list(given)}
    loads.supports_and_loads(mesh, build("analysis", analysis).problem)
    return np.array(found).reshape(-1, 3)


def test_a_load_of_zero_has_no_arrow(monkeypatch):
    assert not len(arrows(monkeypatch, {"at": "x_max", "pressure": 0.0}))
    assert not len(arrows(monkeypatch, {"at": "x_max", "pressure": "0 * x"}))


def test_the_arrow_is_that_of_the_sum_in_one_unit(monkeypatch):
    """1 N on 1 square millimetre is 1 MPa, the same as the pressure across it."""
    both = arrows(monkeypatch, {"at": "x_max", "force": [0, 1, 0], "pressure": 1e6})
    assert len(both) and np.allclose(both, np.array([-1, 1, 0]) / np.sqrt(2), atol=1e-9)


def test_arrows_of_a_moment_go_round(monkeypatch):
    turned = arrows(monkeypatch, {"at": "x_max", "moment": [1.0, 0, 0]})
    assert len(turned) == 4 and np.allclose(turned.sum(axis=0), 0, atol=1e-9)
