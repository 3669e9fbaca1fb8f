"""Schedules fall from 1 to nearly 0, at every step."""

import numpy as np
import pytest

from polycube.diffusion.process import DiffusionProcess
from polycube.registry import build, names


@pytest.mark.parametrize("name", names("schedule"))
@pytest.mark.parametrize("steps", [1, 10, 500])
def test_every_schedule_makes_a_process(name: str, steps: int) -> None:
    alpha_bar = build("schedule", {"plugin": name, "steps": steps})()
    assert alpha_bar.shape == (steps + 1,)
    assert DiffusionProcess(alpha_bar).steps == steps


def test_linear_is_the_published_one() -> None:
    alpha_bar = build("schedule", {"plugin": "linear"})()
    assert len(alpha_bar) == 501
    assert 1 - alpha_bar[1] == pytest.approx(1e-4)
    assert 1 - alpha_bar[500] / alpha_bar[499] == pytest.approx(0.02)


def test_cosine_follows_its_formula_until_the_last_steps() -> None:
    alpha_bar = build("schedule", {"plugin": "cosine"})()
    f = np.cos((np.arange(501) / 500 + 0.008) / 1.008 * np.pi / 2) ** 2
    assert alpha_bar[:490] == pytest.approx((f / f[0])[:490])


def test_sigmoid_follows_its_formula_until_the_last_step() -> None:
    """With start = -end, alpha_bar is 1/2 half-way, and point-symmetric about this point."""
    schedule = build("schedule", {"plugin": "sigmoid", "start": -2.0, "end": 2.0, "tau": 0.5})
    alpha_bar = schedule()
    assert alpha_bar[250] == pytest.approx(0.5, abs=1e-12)
    assert alpha_bar[1:500] + alpha_bar[499:0:-1] == pytest.approx(np.ones(499), abs=1e-12)
    low, high = 1 / (1 + np.exp(4)), 1 / (1 + np.exp(-4))
    here = 1 / (1 + np.exp(-(-2 + 4 * 100 / 500) / 0.5))
    assert alpha_bar[100] == pytest.approx((high - here) / (high - low), rel=1e-12)
    assert alpha_bar[500] == pytest.approx(alpha_bar[499] * 0.001)


def test_a_hot_sigmoid_is_a_straight_line() -> None:
    alpha_bar = build("schedule", {"plugin": "sigmoid", "tau": 1e4})()
    assert alpha_bar[:500] == pytest.approx(1 - np.arange(500) / 500, abs=1e-7)


def test_the_coldest_sigmoid_still_falls_at_every_step() -> None:
    alpha_bar = build("schedule", {"plugin": "sigmoid", "tau": 0.1, "steps": 1000})()
    assert DiffusionProcess(alpha_bar).steps == 1000


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"start": 3.0, "end": 3.0}, "start must be below end; got 3.0 and 3.0"),
        ({"tau": 0.05}, "tau must be at least 0.1 with this range; got 0.05"),
    ],
)
def test_a_sigmoid_without_a_rise_is_refused(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build("schedule", {"plugin": "sigmoid", **options})
