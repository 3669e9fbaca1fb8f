"""Commands: Hydra composes the config, a job runs, the exit code says how it went."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

import polycube.cli.search_path  # noqa: F401  (tells Hydra of plugin packages)
from polycube import HOME
from polycube.cli.overrides import plain_refusals
from polycube.errors import InputError
from polycube.io import manifest

OTHER_FOLDER = "choose another hydra.run.dir, or move the file away"


def command(config_name: str, job: Callable[[dict[str, object], Path], object]) -> None:
    """Run job(config, output folder); exit code 2, and one sentence, for what is refused."""

    @hydra.main(version_base="1.3", config_path=str(HOME / "conf"), config_name=config_name)
    def compose_and_run(cfg: DictConfig) -> None:
        folder = Path(HydraConfig.get().runtime.output_dir)
        try:
            job(OmegaConf.to_container(cfg, resolve=True, throw_on_missing=True), folder)
        except (InputError, OmegaConfBaseException) as error:
            sys.exit(refused(error))  # here, before Hydra adds a line of its own

    try:
        with plain_refusals():
            compose_and_run()
    except InputError as error:
        sys.exit(refused(error))


def begin_sweep(config: DictConfig, names: Sequence[str]) -> None:
    """Check the folder of many jobs, and write `multirun.yaml`, as Hydra will do unasked.

    names : of the files to be written there
    """
    folder = Path(config.hydra.sweep.dir)
    try:
        manifest.check(folder, names)
        with manifest.writing(folder) as scratch:
            OmegaConf.save(config, scratch / "multirun.yaml")
    except InputError as error:
        sys.exit(refused(error))  # of a callback Hydra catches all exceptions


def refused(error: Exception) -> int:
    """The exit code for what is refused; says why on the terminal, in one line."""
    sys.stderr.write(f"error: {' '.join(str(error).split())}\n")
    return 2
