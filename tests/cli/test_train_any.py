"""Training without a grid, from the command line: both networks, evaluation, refusals."""

from collections.abc import Callable
from pathlib import Path

import pytest

from polycube.cli.evaluate import evaluate_weights
from polycube.cli.train import train
from polycube.config import compose
from polycube.diffusion.training.data_module import HELD_OUT
from polycube.diffusion.weights import load_denoiser
from polycube.errors import InputError
from polycube.registry import build, classes
from tests.fixtures.trainings import config

pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")

NETWORKS = [
    ["model=tiny"],
    ["model=points", "model.width=16"],
    ["model=transformer", "model.width=12", "model.heads=2"],
]


@pytest.mark.slow
@pytest.mark.parametrize(
    "network", [NETWORKS[0], *(pytest.param(each, marks=pytest.mark.slow) for each in NETWORKS[1:])]
)
def test_a_training_of_any_structure_gives_weights_that_can_be_measured(
    network: list[str], tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    metrics = train(config("grid=any", *network), tmp_path / "run")
    assert metrics["samples"] == 16 and 0 <= metrics["right_knot"] <= 1
    denoiser = load_denoiser(build, tmp_path / "run")
    assert denoiser.condition.grid == () and denoiser.classes == (6, 7)
    assert not denoiser.options.classifier
    cfg = compose("evaluate", [f"weights={tmp_path}/run", "pairs=5", "batch_size=4"])
    [row] = evaluate_weights(cfg, tmp_path / "found")["weights"]
    assert {"error", "labelled_axis", "labelled_knot", "nearest_axis"} <= set(row["columns"])
    assert "| axis | knot | nearest: axis |" in capsys.readouterr().out


@pytest.mark.slow
def test_a_plugin_may_choose_the_pairs_that_are_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pairs that choose the best checkpoint are those of `held_out`, if the plugin has it."""
    seeds = []

    def held_out(data: Callable, grid: None, primitives: dict, seed: int) -> object:
        seeds.append(seed)
        return data(grid, primitives, seed)

    monkeypatch.setattr(classes()["data", "paired"], "held_out", held_out, raising=False)
    train(config("grid=any", "model=tiny", "trainer.max_epochs=1", "seed=5"), tmp_path)
    assert seeds == [5 + HELD_OUT]


def test_what_needs_a_grid_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="data=paper needs a grid"):
        train(config("grid=any", "data=paper"), tmp_path)
    with pytest.raises(InputError, match=r"grid=auto is for infer\.py"):
        train(config("grid=auto"), tmp_path)
