"""What a training refuses, in one sentence."""

import os
from pathlib import Path

import pytest

from polycube.cli.train import train
from polycube.errors import InputError
from tests.conftest import first_quick
from tests.fixtures.trainings import SMALL, command, config

pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")


@pytest.mark.slow
def test_a_checkpoint_of_another_network_is_refused(tmp_path: Path) -> None:
    train(config("trainer.max_epochs=1"), tmp_path / "run")
    ckpt = tmp_path / "run" / "checkpoints" / "last.ckpt"
    with pytest.raises(InputError, match=r"schedule\.plugin is cosine.*model\.width is 16, was 8"):
        train(config(f"ckpt={ckpt}", "model.width=16", "schedule=cosine"), tmp_path / "other")


@pytest.mark.parametrize(
    ("argument", "message"),
    first_quick(
        3,
        [
            ("sampler.steps=0", "error: sampler=ddim: steps must be a whole number, 1 or more"),
            ("learning.decay=steep", "error: learning.decay must be one of"),
            ("+model.depth=3", "error: model=tiny: got an unexpected keyword argument 'depth'"),
            ("primitives.use=[cube,cone]", "error: no primitive plugin named 'cone'"),
            (
                "denoiser.target=mean",
                "error: denoiser.target must be one of x0, noise, v, move; got",
            ),
            ("learning.thin=2", "error: model=tiny needs whole images, so learning.thin must be 1"),
            ("ema=1", "error: ema must lie between 0 and 1; got 1"),
            ("ckpt=nowhere.ckpt", "error: no checkpoint at nowhere.ckpt"),
            ("ckpt=last", "error: ckpt=last: no run under"),
        ],
    ),
)
def test_a_wrong_option_is_one_sentence_and_exit_code_2(
    argument: str, message: str, here: Path, capsys: pytest.CaptureFixture
) -> None:
    assert command(*SMALL, argument) == 2
    errors = capsys.readouterr().err.strip().splitlines()[-1]
    assert errors.startswith(message)


def test_held_out_pairs_must_be_shared_evenly(tmp_path: Path) -> None:
    two = ("trainer=ddp", "trainer.accelerator=cpu", "trainer.devices=2", "held_out=5")
    with pytest.raises(InputError, match=r"held_out must be a multiple of the 2 processes .*got 5"):
        train(config(*two), tmp_path)
    assert not list(tmp_path.iterdir())


def test_an_unknown_choice_is_refused_with_those_that_exist(
    here: Path, capsys: pytest.CaptureFixture
) -> None:
    assert command("schedule=steep") == 2
    assert "cosine" in capsys.readouterr().err
    assert not os.listdir(here)


def test_missing_checkpoint_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no checkpoint at"):
        train(config("ckpt=nothing.ckpt"), tmp_path)
