"""Arrows of loads: where a load acts, in its direction."""

import numpy as np

from polycube.hexmesh.face_groups import measure
from polycube.registry import build
from polycube.report.pictures.loads import pushes
from polycube.surface.measures import unit
from tests.fixtures.splines import meshed_box


def arrows(*given) -> np.ndarray:
    """Directions (N, 3) of the arrows of loads on a box of 4 x 1 x 1 mm, of length 1."""
    mesh, _ = meshed_box((4, 2, 2), (4.0, 1.0, 1.0))
    analysis = {"plugin": "static", "units": "mm", "gravity": [0, 0, 0], "loads": list(given)}
    problem, faces = build("analysis", analysis).problem, measure(mesh.vertices[mesh.quads])
    vectors = [vector for _, vector in pushes(mesh, problem, faces, 0.2)]
    return unit(np.array(vectors).reshape(-1, 3))


def test_a_load_of_zero_has_no_arrow():
    assert not len(arrows({"at": "x_max", "pressure": 0.0}))
    assert not len(arrows({"at": "x_max", "pressure": "0 * x"}))


def test_the_arrow_is_that_of_the_sum_in_one_unit():
    """1 N on 1 square millimetre is 1 MPa, the same as the pressure across it."""
    both = arrows({"at": "x_max", "force": [0, 1, 0], "pressure": 1e6})
    assert len(both) and np.allclose(both, np.array([-1, 1, 0]) / np.sqrt(2), atol=1e-9)


def test_arrows_of_a_moment_go_round():
    turned = arrows({"at": "x_max", "moment": [1.0, 0, 0]})
    assert len(turned) == 4 and np.allclose(turned.sum(axis=0), 0, atol=1e-9)
