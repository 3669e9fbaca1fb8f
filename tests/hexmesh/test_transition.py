"""Why there is no local refinement by templates: the best template in a perfect cube.

One corner of a hex is refined to a third; three hexes join the small cube to the far faces.  Along
the edge from the far corner inwards all three meet, so one of their angles there is at most that
of a cube's diagonal: 1 / sqrt(3), wherever the inner vertex lies.
"""

import numpy as np
import pytest

from polycube.hexmesh.connectivity import PLACES
from polycube.hexmesh.scaled_jacobian import scaled_jacobian


def transition(inner: np.ndarray) -> np.ndarray:
    """(4, 8, 3) corners: the small cube and the three hexes round it."""
    small = PLACES / 3.0
    small[6] = inner
    found = [small]
    for axis in range(3):
        beyond = PLACES.copy()
        beyond[:, axis] = 1
        across = (PLACES[:, None] == beyond).all(axis=2).argmax(axis=0)
        is_near = PLACES[:, [axis]] == 0
        corners = np.where(is_near, small[across], PLACES)
        found.append(corners)
    return np.array(found)


def worst(corners: np.ndarray) -> float:
    return scaled_jacobian(
        corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 8)
    ).min()


def test_template_in_a_perfect_cube():
    assert worst(transition(np.full(3, 1 / 3))) == pytest.approx(1 / np.sqrt(3))


def test_no_position_of_the_inner_vertex_is_better():
    rng = np.random.default_rng(0)
    for inner in rng.uniform(0.05, 0.95, (300, 3)):
        assert worst(transition(inner)) <= 1 / np.sqrt(3) + 1e-9
