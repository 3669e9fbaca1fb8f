"""train.py from the command line: options, files, resuming, refusals."""

import json
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from polycube import HOME
from polycube.cli.train import train
from polycube.config import compose, loader
from polycube.diffusion.denoiser import DenoiserOptions
from polycube.diffusion.training.learning import Learning
from polycube.diffusion.weights import load_denoiser
from polycube.registry import build
from tests.conftest import first_quick
from tests.fixtures.trainings import SMALL, command, config

pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")


def options(group: str) -> list[str]:
    return [f"{group}={name}" for name in loader().get_group_options(group)]


@pytest.mark.parametrize(
    "choice",
    first_quick(6, [c for g in ("schedule", "model", "sampler", "data") for c in options(g)]),
)
def test_every_option_composes_and_builds(choice: str) -> None:
    group = choice.split("=")[0]
    assert build(group, compose("train", [choice])[group])


@pytest.mark.parametrize("choice", first_quick(2, [*options("trainer"), *options("experiment")]))
def test_every_trainer_and_experiment_composes(choice: str) -> None:
    assert compose("train", [choice])["trainer"]["_target_"] == "lightning.pytorch.Trainer"


def test_every_option_of_learning_and_denoiser_is_in_the_yaml() -> None:
    cfg = config()
    assert {*cfg["learning"], "seed"} == {field.name for field in fields(Learning)}
    assert {*cfg["denoiser"], "pads"} == {field.name for field in fields(DenoiserOptions)}


def test_paper_experiment_is_the_published_setting() -> None:
    cfg = OmegaConf.create(compose("train", ["experiment=paper"]))
    assert (cfg.batch_size, cfg.trainer.max_epochs, cfg.schedule.steps) == (200, 400, 500)
    assert (cfg.schedule.beta_start, cfg.schedule.beta_end) == (1e-4, 0.02)
    assert (cfg.learning.rate, cfg.learning.decay, cfg.data.plugin) == (1e-3, "linear", "paper")
    assert (cfg.learning.loss, cfg.learning.endpoint, cfg.learning.thin) == ("mse", 0, 1)
    assert (cfg.model.plugin, cfg.model.width, cfg.sampler.plugin) == ("unet", 64, "ddpm")
    assert (cfg.ema, cfg.trainer.gradient_clip_val) == (0, None)
    assert cfg.denoiser == {
        "target": "noise",
        "geometry_channels": False,
        "normals": False,
        "labels": False,
        "classifier": False,
        "noise_scale": 1.0,
    }


@pytest.mark.slow
def test_command_writes_weights_checkpoints_and_curves(here: Path) -> None:
    assert command(*SMALL, "schedule=cosine", "sampler=ddim") == 0
    (run,) = (here / "outputs" / "train").iterdir()
    assert {p.name for p in (run / "checkpoints").iterdir()} == {"best.ckpt", "last.ckpt"}
    metrics = json.loads((run / "weights" / "weights.json").read_text())
    assert {
        "loss",
        "loss_points",
        "loss_labels",
        "loss_context",
        "lr",
        "error",
        "error_p95",
        "right_context",
        "samples_per_second",
    } <= metrics.keys()
    assert (metrics["steps"], metrics["samples"]) == (4, 16)
    assert load_denoiser(build, run / "weights").process.steps == 20
    curves = EventAccumulator(str(run / "tensorboard")).Reload()
    assert [event.step for event in curves.Scalars("error")] == [1, 3]
    assert curves.Scalars("error")[-1].value == pytest.approx(metrics["error"])
    assert curves.Scalars("final/error")[0].value == pytest.approx(metrics["error"])
    assert curves.Images("geometry, x_0, truth")[0].height > 100
    hparams = curves.SummaryMetadata("_hparams_/session_start_info").plugin_data.content
    assert b"denoiser/target" in hparams and b"learning/rate" in hparams
    assert (run / "loss.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_sweep_has_a_training_for_each_value(here: Path) -> None:
    small = ("trainer.max_epochs=1", "batches_per_epoch=1", "held_out=2")
    assert command("-m", *SMALL, *small, "schedule=linear,cosine", "learning.rate=1e-3") == 0
    (sweep,) = (here / "outputs" / "train-sweep").iterdir()
    assert (sweep / "multirun.yaml").is_file()
    for number, schedule in enumerate(("linear", "cosine")):
        chosen = (sweep / f"{number}" / ".hydra" / "overrides.yaml").read_text()
        assert f"schedule={schedule}" in chosen
        found = json.loads((sweep / f"{number}" / "weights" / "weights.json").read_text())
        curves = EventAccumulator(str(sweep / f"{number}" / "tensorboard")).Reload()
        assert curves.Scalars("final/error")[0].value == pytest.approx(found["error"])


@pytest.mark.slow
def test_networks_for_any_size_train_on_thin_images(tmp_path: Path) -> None:
    small = ("model=points", "model.width=8", "model.blocks=1", "model.slots=2")
    errors = [
        train(config(*small, f"learning.thin={thin}", "trainer.max_epochs=1"), tmp_path / thin)
        for thin in ("null", "3", "4")
    ]
    assert all(metrics["steps"] == 2 and 0 < metrics["error"] < 5 for metrics in errors)
    assert errors[0]["error"] == errors[1]["error"] != errors[2]["error"]


@pytest.mark.parametrize(
    "averaged",
    [
        pytest.param(["ema=0.9"], id="averaged", marks=pytest.mark.slow),
        pytest.param(["ema=0", "workers=1"], id="workers", marks=pytest.mark.slow),
    ],
)
def test_resumed_training_follows_the_same_curve(averaged: list[str], tmp_path: Path) -> None:
    """Four epochs at once, and two, then two more: the same weights, bit for bit."""
    epochs = ["trainer.max_epochs=4", "trainer.check_val_every_n_epoch=2"]
    once = train(config(*epochs, *averaged), tmp_path / "whole")
    train(config(*epochs, *averaged, "+trainer.max_steps=4"), tmp_path / "halves" / "first")
    twice = train(config(*epochs, *averaged, "ckpt=last"), tmp_path / "halves" / "second")
    whole, halves = (
        torch.load(tmp_path / run / "checkpoints" / "last.ckpt", weights_only=True)
        for run in ("whole", "halves/second")
    )
    assert whole["global_step"] == halves["global_step"] == 8
    assert ("current_model_state" in whole) == ("ema=0" not in averaged)
    for weights in ("state_dict", "current_model_state", "averaging_state"):
        for name, tensor in whole.get(weights, {}).items():
            assert torch.equal(tensor, halves[weights][name]), name
    assert once | {"samples_per_second": 0} == twice | {"samples_per_second": 0}


@pytest.mark.slow
def test_a_checkpoint_is_measured_and_exported_without_training(tmp_path: Path) -> None:
    trained = train(config("trainer.max_epochs=1"), tmp_path / "run")
    ckpt = tmp_path / "run" / "checkpoints" / "last.ckpt"
    measured = train(config("fit=false", f"ckpt={ckpt}"), tmp_path / "export")
    assert measured["error"] == pytest.approx(trained["error"], rel=1e-5)
    assert measured["steps"] == 2
    files = [tmp_path / run / "weights" / "weights.safetensors" for run in ("run", "export")]
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("averaged", [[], ["ema=0.9"]])
def test_a_training_killed_after_its_last_step_is_exported(
    averaged: list[str], tmp_path: Path
) -> None:
    whole, again = tmp_path / "whole", tmp_path / "again"
    small = [*averaged, "model=points", "model.width=8", "trainer.max_epochs=1"]
    metrics = train(config(*small), whole)
    ckpt = f"ckpt={whole}/checkpoints/last.ckpt"
    resumed = train(config(*small, ckpt), again)
    assert resumed["error"] == metrics["error"] and resumed["steps"] == metrics["steps"]
    first, second = (path / "weights/weights.safetensors" for path in (whole, again))
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.slow
def test_training_imports_no_meshing_libraries() -> None:
    """It runs on a machine without a display, open3d, VTK or igl."""
    code = (
        "import sys, polycube.cli.train; from polycube.registry import names; names('model');"
        "print(sorted({'open3d', 'vtkmodules', 'pyvista', 'igl', 'trimesh'}"
        " & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=HOME, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
