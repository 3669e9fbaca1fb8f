"""Sizes of hexes for requested numbers, on a block with a hole and known lengths."""

import numpy as np
import pytest

from polycube.hexmesh.generation.requests import Request
from polycube.hexmesh.generation.requests_met import wanted_sizes
from polycube.surface.fit_target import target
from tests.fixtures.machined import bored

BLOCK = bored()  # 4 x 4 x 2, with a hole of 16 sides and radius 1
UNIT = 6.0  # its diagonal
RIM = 16 * 2 * np.sin(np.pi / 16)


@pytest.mark.parametrize(
    ("request_", "size", "rel"),
    [
        (Request("hole_1", "around", 32), RIM / 32, 1e-9),
        (Request("z_max", "through", 4), 2 / 4, 1e-9),
        (Request("x_min", "size", 0.3), 0.3, 1e-9),
        (Request("x_min", "size", "2%"), 0.02 * UNIT, 1e-9),
    ],
)
def test_each_kind_of_request_gives_one_size_on_its_face(request_, size, rel):
    points, sizes = wanted_sizes(BLOCK, [request_])
    assert sizes * UNIT == pytest.approx(np.full(len(points), size), rel=rel)
    places = target(BLOCK).to_model(points)
    if request_.at == "hole_1":
        radius = np.linalg.norm(places[:, :2], axis=1)
        assert (radius < 1 + 1e-9).all() and radius.min() > np.cos(np.pi / 16) - 1e-9
    else:
        axis, level = {"z_max": (2, 2.0), "x_min": (0, -2.0)}[request_.at]
        assert places[:, axis] == pytest.approx(np.full(len(points), level))


def test_no_request_gives_no_sizes():
    points, sizes = wanted_sizes(BLOCK, [])
    assert points.shape == (0, 3) and sizes.shape == (0,)
