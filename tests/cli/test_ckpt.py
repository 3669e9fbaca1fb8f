"""`infer.py ckpt=`: a denoiser of one's own, by a path from where the user stands."""

from pathlib import Path

import numpy as np
import pytest

from polycube.cli.train import train
from polycube.config import compose
from polycube.diffusion.weights import shipped
from polycube.errors import InputError
from polycube.pipeline.intake import read_part
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.plugins.structure.learned.hypotheses import denoiser_of_any, denoiser_of_grid

pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")

TINY = ("experiment=smoke", "batch_size=2", "batches_per_epoch=1", "held_out=2")
SHORT = ("schedule.steps=20", "trainer.max_epochs=1", "+trainer.enable_progress_bar=false")


def config(name: str, *overrides: str) -> dict[str, object]:
    return compose(name, overrides)


def propose(output: Path, *overrides: str) -> str:
    """The proposal that is taken for a made part, without meshing it."""
    chosen = (
        "mesh=example:dice",
        "structure=diffusion",
        "order=[]",
        "structure.tried=2",
        f"output_dir={output}",
    )
    settings = Settings.of(config("infer", *chosen, *overrides))
    state = Run(settings, read_part).begin()
    return state.ranked[state.chosen].candidate.proposal


@pytest.mark.parametrize(("structure", "count"), [("auto", 2), ("diffusion", 1), ("drawn", 1)])
def test_every_plugin_with_a_network_gets_the_weights_of_ckpt(structure: str, count: int) -> None:
    cfg = config("infer", "mesh=x.stl", f"structure={structure}", "ckpt=mine.ckpt")["structure"]
    plugins = cfg.get("proposals", {"only": cfg}).values()
    assert [p["weights"] for p in plugins if "weights" in p] == count * ["mine.ckpt"]


def test_weights_of_a_grid_and_of_any_structure_serve_their_own_proposals(caplog) -> None:
    grid, free = (str(shipped(of)) for of in ((2, 1, 1), ()))
    assert denoiser_of_grid(free, (2, 1, 1), {"cube": np.ones((3, 3, 3), bool)}).condition.grid
    assert "are for any structure, not a grid; proposals of a grid use" in caplog.text
    assert not denoiser_of_any(grid).condition.grid
    assert "are for a grid, not any structure; proposals of any structure use" in caplog.text


@pytest.mark.slow
def test_weights_of_a_new_training_give_proposals(here: Path) -> None:
    train(config("train", *TINY, *SHORT), here / "training")
    for path in ("training/checkpoints/last.ckpt", "training/weights", "training"):
        assert propose(here / "run", f"ckpt={path}") == "diffusion"


def test_a_grid_without_weights_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no trained weights for .* on a 3x1x1 grid"):
        propose(tmp_path / "run", "grid=3x1")


def test_a_path_with_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no weights at .*nowhere.*; train.py writes them"):
        propose(tmp_path / "run", f"ckpt={tmp_path / 'nowhere.ckpt'}")
    assert not (tmp_path / "run").exists()
