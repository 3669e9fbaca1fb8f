"""No file that is read can run code: weights, checkpoints, cached stages."""

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from polycube.cli.train import train
from polycube.config import compose
from polycube.diffusion.training.learning import AtomicCheckpoints
from polycube.diffusion.weights import config_of, load_denoiser
from polycube.errors import InputError
from polycube.pipeline.resume.results import load_stage
from polycube.registry import build


class Runs:
    """Makes a file where it is loaded as a pickle."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Callable, tuple[Path]]:
        return Path.touch, (self.mark,)


@pytest.fixture
def trap(tmp_path: Path):
    """An object that leaves a file when it is run; asserts at the end that it was not run."""
    mark = tmp_path / "code was run"
    pickle.loads(pickle.dumps(Runs(mark)))  # the trap works
    assert mark.is_file()
    mark.unlink()
    yield Runs(mark)
    assert not mark.exists()


def checkpoint(path: Path, trap: Runs, zipped: bool = True) -> Path:
    made = {"state_dict": {"denoiser.x": trap}, "hyper_parameters": {"config": trap}}
    torch.save(made, path, _use_new_zipfile_serialization=zipped)
    return path


@pytest.mark.parametrize("kind", ["zip", "old", "plain pickle"])
def test_a_checkpoint_runs_no_code(kind: str, tmp_path: Path, trap: Runs) -> None:
    path = checkpoint(tmp_path / "last.ckpt", trap, kind == "zip")
    if kind == "plain pickle":
        path.write_bytes(pickle.dumps(trap, 2))
    for read in (lambda: load_denoiser(build, path), lambda: config_of(path)):
        with pytest.raises(InputError, match="objects that could run code, which are never loaded"):
            read()
    with pytest.raises(pickle.UnpicklingError):
        AtomicCheckpoints(tmp_path).load_checkpoint(path)


def test_a_training_does_not_load_a_harmful_checkpoint(tmp_path: Path, trap: Runs) -> None:
    path = checkpoint(tmp_path / "last.ckpt", trap)
    settings = ("experiment=smoke", "batch_size=2", "batches_per_epoch=1", "held_out=2")
    with pytest.raises(InputError, match=r"last\.ckpt .* could run code"):
        train(compose("train", [*settings, f"ckpt={path}"]), tmp_path / "run")
    with pytest.raises(InputError, match=r"last\.ckpt .* could run code"):
        train(compose("train", [*settings, f"begin_from={path}"]), tmp_path / "run")


@pytest.mark.parametrize("harmful", [".safetensors", ".yaml"])
def test_weights_run_no_code(harmful: str, tmp_path: Path, trap: Runs) -> None:
    path = tmp_path / "weights.safetensors"
    save_file({"x": torch.ones(1)}, path)
    path.with_suffix(".yaml").write_text("{}")
    if harmful == ".yaml":
        text = f"!!python/object/apply:pathlib.Path.touch [!!python/name:{trap.mark}]"
        path.with_suffix(".yaml").write_text(text)
    else:
        path.write_bytes(pickle.dumps(trap))
    with pytest.raises(InputError, match="does not contain the network of its config"):
        load_denoiser(build, path)


def test_arrays_run_no_code(tmp_path: Path, trap: Runs) -> None:
    path = tmp_path / "stages" / "spline.npz"
    path.parent.mkdir()
    np.savez(path, allow_pickle=True, tree=np.array([trap], object), geometry=np.array([trap]))
    with pytest.raises(InputError, match="the stored result is damaged"):
        load_stage(tmp_path, "spline")
