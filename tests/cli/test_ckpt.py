"""`infer.py ckpt=`: a denoiser of one's own, by a path from where the user stands."""

from pathlib import Path

import pytest

from polycube.cli.train import train
from polycube.config import compose
from polycube.errors import InputError
from polycube.pipeline.intake import read_part
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings

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


@pytest.mark.parametrize("structure", ["auto", "diffusion", "classify"])
def test_all_that_use_the_network_take_it_from_there(structure: str) -> None:
    cfg = config("infer", "mesh=x.stl", f"structure={structure}", "ckpt=mine.ckpt")["structure"]
    plugins = cfg.get("proposals", {"only": cfg}).values()
    assert [p["weights"] for p in plugins if "weights" in p] == ["mine.ckpt"]


def test_a_training_of_ones_own_proposes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    train(config("train", *TINY, *SHORT), tmp_path / "training")
    monkeypatch.chdir(tmp_path)
    for path in ("training/checkpoints/last.ckpt", "training/weights", "training"):
        assert propose(tmp_path / "run", f"ckpt={path}") == "diffusion"


def test_without_weights_for_the_grid_it_says_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no trained weights for .* on a 3x1x1 grid"):
        propose(tmp_path / "run", "grid=3x1")


def test_a_path_with_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no weights at .*nowhere.*; train.py writes them"):
        propose(tmp_path / "run", f"ckpt={tmp_path / 'nowhere.ckpt'}")
    assert not (tmp_path / "run").exists()
