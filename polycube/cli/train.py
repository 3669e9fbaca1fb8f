"""`train.py`: train a network on pairs and write its weights.

Exit codes: 0, or 2 for an invalid option.
"""

import logging
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import hydra
import lightning.pytorch as L
from hydra.errors import InstantiationException
from lightning.pytorch.callbacks import ModelCheckpoint, WeightAveraging
from lightning.pytorch.loggers import TensorBoardLogger
from omegaconf import DictConfig

from polycube.cli.command import OTHER_FOLDER, Sweep, command
from polycube.diffusion import weights
from polycube.diffusion.pairs.templates import turned_contexts
from polycube.diffusion.training import pictures
from polycube.diffusion.training.data_module import PairData
from polycube.diffusion.training.learning import AtomicCheckpoints, Learning, moving_average
from polycube.diffusion.training.module import DDPMPolycube
from polycube.diffusion.training.pictures import Pictures
from polycube.diffusion.weights import Recipe
from polycube.errors import InputError, brief
from polycube.io import manifest
from polycube.pipeline.primitives import voxels
from polycube.pipeline.resume.settings import changed_settings
from polycube.registry import build
from polycube.types import Json

logger = logging.getLogger(__name__)

Options = ParamSpec("Options")
Made = TypeVar("Made")

WEIGHTS = tuple(f"weights/weights.{suffix}" for suffix in ("safetensors", "yaml", "json"))
CHECKPOINTS = tuple(f"checkpoints/{name}.ckpt" for name in ("best", "last"))
THIN = 3  # for networks on points: a ninth of the points, 1.5 times faster than a quarter


class Trainings(Sweep):
    """A sweep of trainings in Hydra."""

    def on_multirun_end(self, config: DictConfig, **_: object) -> None:
        """Name the command that compares the trainings."""
        logger.info("to compare them: tensorboard --logdir %s", config.hydra.sweep.dir)


def train(cfg: Json, folder: Path) -> dict[str, float]:
    """Train a denoiser and write its weights to `folder`/weights; returns the final metrics."""
    manifest.check(folder, ["loss.png", *WEIGHTS, *CHECKPOINTS], remedy=OTHER_FOLDER)
    L.seed_everything(cfg["seed"], verbose=False)
    data = build("data", cfg["data"])
    if cfg["grid"].get("among"):
        raise InputError("grid=auto is for infer.py; train.py needs a grid, or grid=any")
    grid = cfg["grid"]["shape"]
    primitives = _checked(voxels, cfg["primitives"]["use"]) if grid else {}
    config = _denoiser_config(cfg, pads=data.pads)
    denoiser = _checked(weights.make_denoiser, config, build)
    if cfg["begin_from"]:
        taken = weights.begin_from(denoiser, weights.load_denoiser(build, cfg["begin_from"]))
        total = len(denoiser.state_dict())
        logger.info("%d of %d tensors are copied from %s", taken, total, cfg["begin_from"])
    learning = _learning(cfg)
    pairs = _checked(data, grid, primitives, cfg["seed"])
    others = partial(_checked, getattr(data, "held_out", data), grid, primitives)
    if not grid:
        pairs.views = cfg["views"]
    turned = None
    if denoiser.options.classifier:
        turned = turned_contexts(pairs.contexts, grid, primitives)
    optimizer = _instance(cfg["optim"], _partial_=True)
    sampler = build("sampler", cfg["sampler"])
    module = DDPMPolycube(denoiser, learning, sampler, config, turned, optimizer)
    if cfg["compile"]:
        denoiser.network.compile()
    numbers = cfg["held_out"], cfg["test"]
    loading = {name: cfg[name] for name in ("batch_size", "batches_per_epoch", "workers")}
    images = PairData(pairs, others, denoiser.condition, cfg["seed"], numbers, **loading)
    checkpoint = _checkpoint(cfg["ckpt"], config, folder)
    most = cfg["trainer"].get("max_epochs") or 0  # 0 and -1: no limit of epochs
    if checkpoint and 0 < most <= weights.epochs_of(checkpoint):
        logger.info("%s is the end of its training: it is measured and exported", checkpoint)
        cfg = {**cfg, "fit": False}
    trainer = _trainer(cfg, folder)
    if cfg["fit"]:
        trainer.fit(module, datamodule=images, ckpt_path=checkpoint)
    else:
        trainer.validate(module, datamodule=images, ckpt_path=checkpoint, verbose=False)
    measured = dict(trainer.callback_metrics)
    if cfg["test"]:
        trainer.test(module, datamodule=images, verbose=False)
        measured |= trainer.callback_metrics
    metrics = {name.replace("/", "_"): float(value) for name, value in measured.items()}
    metrics |= {"steps": module.steps_done, "samples": module.pairs_done}
    if trainer.is_global_zero:  # the other processes have the same weights and numbers
        _write(cfg, config, trainer, module, metrics, folder)
    return metrics


def _write(
    cfg: Json,
    config: Recipe,
    trainer: L.Trainer,
    module: DDPMPolycube,
    metrics: dict[str, float],
    folder: Path,
) -> None:
    """Write the weights, the picture of the curves and the last values for TensorBoard."""
    if isinstance(trainer.logger, TensorBoardLogger):
        final = {f"final/{name}": value for name, value in metrics.items()}
        trainer.logger.log_hyperparams(dict(cfg), final, module.steps_done)
        trainer.logger.experiment.flush()
    with manifest.writing(folder, OTHER_FOLDER) as scratch:
        pictures.draw(pictures.curves(folder), scratch / "loss.png")
        weights.save_denoiser(module.denoiser, config, metrics, scratch / "weights")
    error = f"error {metrics['error']:.3f}" if "error" in metrics else "no error measured"
    logger.info("%s; weights in %s", error, folder / WEIGHTS[0])


def _learning(cfg: Json) -> Learning:
    """Options of the training; raises InputError if the network does not support them."""
    any_size = getattr(build("model", cfg["model"]), "any_size", False)
    thin = cfg["learning"]["thin"] or (THIN if any_size and cfg["grid"]["shape"] else 1)
    learning = _checked(Learning, **{**cfg["learning"], "thin": thin}, seed=cfg["seed"])
    if learning.thin > 1 and not any_size:
        what = f"model={cfg['model']['plugin']} needs whole images, so learning.thin must be 1"
        raise InputError(f"{what}; got {learning.thin}")
    return learning


def main() -> None:
    """Command line; warnings of libraries are suppressed."""
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)
    # from Lightning's use of torch
    warnings.filterwarnings("ignore", ".*LeafSpec.*", FutureWarning)
    command("train", train)


def _denoiser_config(cfg: Json, pads: bool) -> Recipe:
    """Recipe of the denoiser, stored in checkpoints and weights."""
    grid = cfg["grid"]["shape"]
    options = {**cfg["denoiser"], "pads": pads}
    if not grid:  # there are no contexts to classify
        options["classifier"] = False
    return {
        "grid": list(grid) if grid else None,
        "primitives": list(cfg["primitives"]["use"]) if grid else [],
        "schedule": dict(cfg["schedule"]),
        "model": dict(cfg["model"]),
        "options": options,
    }


def _trainer(cfg: Json, folder: Path) -> L.Trainer:
    """Trainer of Lightning, with checkpoints, averaged weights, TensorBoard and pictures.

    Callbacks and plugins of the user are added to these; other arguments replace the defaults.
    """
    saved = partial(ModelCheckpoint, folder / "checkpoints", enable_version_counter=False)
    best = saved(filename="best", monitor="error")
    last = saved(filename="last", save_on_train_epoch_end=True)  # each epoch, validated or not
    given = {
        "use_distributed_sampler": False,  # the samplers of this program support several processes
        "limit_train_batches": cfg["batches_per_epoch"],
        "default_root_dir": str(folder),
        "enable_model_summary": False,
        **cfg["trainer"],
        "log_every_n_steps": min(cfg["trainer"]["log_every_n_steps"], cfg["batches_per_epoch"]),
    }
    callbacks, plugins = (_instances(given.pop(name, None)) for name in ("callbacks", "plugins"))
    if "logger" not in given:
        given["logger"] = _instance(cfg["logger"], save_dir=str(folder))
    callbacks = [best, last, Pictures(), *_instances(cfg["callbacks"]), *callbacks]
    plugins = [AtomicCheckpoints(folder), *plugins]
    trainer = _instance(given, callbacks=callbacks, plugins=plugins)
    if cfg["fit"] and cfg["ema"]:
        average = _checked(moving_average, cfg["ema"])
        device = trainer.strategy.root_device  # device of the weights
        trainer.callbacks.insert(0, WeightAveraging(device, multi_avg_fn=average))
    for name in ("held_out", "test"):
        if cfg[name] < 0 or cfg[name] % trainer.world_size:
            sharing = f"the {trainer.world_size} processes that share it"
            raise InputError(f"{name} must be a multiple of {sharing}; got {cfg[name]}")
    return trainer


def _instances(configs: Any) -> list[Any]:
    """Objects of a list of configurations, or of those in a mapping."""
    listed = configs.values() if isinstance(configs, dict) else configs or ()
    return [_instance(each) for each in listed]


def _instance(config: Any, **arguments: object) -> Any:
    """Object of a configuration with a _target_; raises InputError if it cannot be made."""
    try:
        return hydra.utils.instantiate(config, **arguments)
    except InstantiationException as error:
        cause = error.__cause__
        reason = brief(cause if isinstance(cause, Exception) else error)
        raise InputError(f"{config.get('_target_', config)} cannot be made: {reason}") from error


def _checkpoint(ckpt: str | None, config: Recipe, folder: Path) -> Path | None:
    """Checkpoint to resume: a path, or `last` of the newest other run next to `folder`.

    config : recipe of the denoiser; raises InputError if the checkpoint has a different one
    """
    if ckpt is None:
        return None
    path = Path(ckpt)
    if ckpt == "last":
        found = folder.parent.glob("*/checkpoints/last.ckpt")
        newest = max(found, key=lambda path: path.stat().st_mtime, default=None)
        if newest is None:
            raise InputError(f"ckpt=last: no run under {folder.parent} has checkpoints/last.ckpt")
        path = newest
    if not path.is_file():
        raise InputError(f"no checkpoint at {path}; ckpt is a file, last, or null")
    if others := changed_settings(config, weights.config_of(path), config):
        what = f"ckpt: {path} belongs to another training: {'; '.join(others)}"
        remedy = "use the same settings, or only its weights, with begin_from="
        raise InputError(what, remedy=remedy)
    return path


def _checked(make: Callable[Options, Made], *args: Options.args, **kwargs: Options.kwargs) -> Made:
    try:
        return make(*args, **kwargs)
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(str(error.args[0] if error.args else error)) from error
