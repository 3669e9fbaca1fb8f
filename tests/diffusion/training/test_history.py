"""The curves of a training, read back and drawn."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from torch.utils.tensorboard import SummaryWriter

from polycube.diffusion.training.pictures import curves, draw, smoothed


def test_what_was_written_is_read_back(tmp_path: Path) -> None:
    writer = SummaryWriter(tmp_path / "tensorboard")
    for step in (0, 5, 15):
        writer.add_scalar("loss", 2.0**-step, step)
    writer.add_scalar("error", 0.25, 15)
    writer.close()
    found = curves(tmp_path)
    assert found["loss"].tolist() == [[0, 1], [5, 2**-5], [15, 2**-15]]
    assert found["error"].tolist() == [[15, 0.25]]


@given(st.integers(1, 200), st.floats(0, 1), st.floats(-5, 5))
def test_smoothing_leaves_a_straight_line(n: int, share: float, slope: float) -> None:
    line = np.column_stack([np.arange(n), 3 + slope * np.arange(n)])
    assert smoothed(line, share) == pytest.approx(line, abs=1e-9)


def test_smoothing_is_the_mean_of_neighbours() -> None:
    curve = np.column_stack([np.arange(5), [0, 3, 0, 3, 0]])
    assert smoothed(curve, 0.4)[:, 1] == pytest.approx([0, 1, 2, 1, 0])


@pytest.mark.parametrize("names", [["loss", "error", "error/untouched"], ["error"], []])
def test_a_picture_of_what_was_measured(names: list[str], tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    steps = np.arange(40)
    known = {
        "loss": np.column_stack([steps, np.exp(-steps / 20) + 0.1 * rng.random(40)]),
        "error": np.array([[20, 0.4], [40, 0.2]]),
        "error/untouched": np.array([[20, 0.45], [40, 0.45]]),
    }
    path = draw({name: known[name] for name in names}, tmp_path / "loss.png")
    assert path.read_bytes().startswith(b"\x89PNG")
