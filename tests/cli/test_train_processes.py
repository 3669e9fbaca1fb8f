"""Trainings that are killed, and trainings of several processes."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from polycube import HOME

SMALL = [
    "experiment=smoke",
    "model=points",
    "model.width=16",
    "model.blocks=1",
    "model.slots=4",
    "batches_per_epoch=3",
    "trainer.max_epochs=3",
    "held_out=6",
    "schedule.steps=20",
    "ema=0.9",
    "+trainer.enable_progress_bar=false",
]

# train.py, but in the middle of the second epoch the process is killed
DYING = """
import os, signal
from polycube.diffusion.training.module import DDPMPolycube
step = DDPMPolycube.training_step
def dying(module, batch, index):
    if module.global_step == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return step(module, batch, index)
DDPMPolycube.training_step = dying
from polycube.cli.train import main
main()
"""


def run(folder: Path, *arguments: str, program: tuple[str, ...] = ("train.py",)) -> int:
    command = [sys.executable, *program, *SMALL, *arguments, f"hydra.run.dir={folder}"]
    return subprocess.run(command, cwd=HOME, capture_output=True, timeout=300).returncode


def last(folder: Path) -> dict:
    return torch.load(folder / "checkpoints" / "last.ckpt", weights_only=True)


def metrics(folder: Path) -> dict[str, float]:
    found = json.loads((folder / "weights" / "weights.json").read_text())
    del found["samples_per_second"]
    return found


@pytest.mark.slow
def test_a_killed_training_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    """From the end of the first epoch: the same weights, averages, moments and numbers."""
    killed = run(tmp_path / "killed", "batch_size=4", "workers=1", program=("-c", DYING))
    assert killed == -signal.SIGKILL
    assert last(tmp_path / "killed")["global_step"] == 3
    assert run(tmp_path / "resumed", "batch_size=4", "workers=1", "ckpt=last") == 0
    assert run(tmp_path / "whole", "batch_size=4") == 0
    whole, resumed = last(tmp_path / "whole"), last(tmp_path / "resumed")
    assert whole["global_step"] == resumed["global_step"] == 9
    for state in ("state_dict", "current_model_state", "averaging_state"):
        for name, tensor in whole[state].items():
            assert torch.equal(tensor, resumed[state][name]), name
    moments = [checkpoint["optimizer_states"][0]["state"] for checkpoint in (whole, resumed)]
    for number, moment in moments[0].items():
        assert all(torch.equal(moment[name], moments[1][number][name]) for name in moment)
    assert metrics(tmp_path / "whole") == metrics(tmp_path / "resumed")


@pytest.mark.slow
def test_two_processes_train_as_one_with_batches_twice_as_large(tmp_path: Path) -> None:
    """To rounding, which Adam turns into steps of full length where a gradient is nearly zero.

    So a few weights are off by some 1e-4, their mean by 1e-8; with other pairs it is 1e-3.
    """
    two = ("trainer=ddp", "trainer.accelerator=cpu", "trainer.devices=2", "trainer.max_epochs=3")
    assert run(tmp_path / "two", *two, "batch_size=4") == 0
    assert run(tmp_path / "one", "batch_size=8") == 0
    one, both = last(tmp_path / "one"), last(tmp_path / "two")
    assert one["global_step"] == both["global_step"] == 9
    for state in ("state_dict", "current_model_state"):
        off = [(one[state][name] - both[state][name]).abs().flatten() for name in one[state]]
        assert torch.cat(off).mean() < 1e-6
    alone, together = metrics(tmp_path / "one"), metrics(tmp_path / "two")
    assert together == pytest.approx(alone, rel=1e-4)
    assert together["samples"] == 72
    logs = {path.name for path in (tmp_path / "two").iterdir()}
    assert "train_ddp_process_1.log" in logs  # there was a second process
    writers = {path.name.split(".")[-2] for path in (tmp_path / "two").glob("tensorboard/events*")}
    assert len(writers) == 1  # only the first one writes
