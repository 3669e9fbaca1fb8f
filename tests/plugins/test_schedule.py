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
