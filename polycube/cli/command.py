"""Commands: Hydra composes the config, a job runs, the exit code says how it went."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.errors import HydraException
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from polycube import HOME
from polycube.cli.arguments import quoted
from polycube.config import add_sources, plain, refusal
from polycube.errors import InputError
from polycube.io import manifest
from polycube.types import Json

OTHER_FOLDER = "choose another hydra.run.dir, or move the file away"


class PluginConfigs(SearchPathPlugin):
    """Lets `hydra.main` see plugin classes and the configuration of plugin packages."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        add_sources(search_path)


Plugins.instance().register(PluginConfigs)


def command(config_name: str, job: Callable[[Json, Path], object]) -> None:
    """Run job(config, output folder); exit code 2, and one sentence, for what is refused."""

    def task(cfg: DictConfig) -> None:
        folder = Path(HydraConfig.get().runtime.output_dir)
        try:
            job(plain(cfg, throw_on_missing=True), folder)
        except (InputError, OmegaConfBaseException) as error:
            sys.exit(refused(error))  # here, before Hydra adds a line of its own

    try:
        run_hydra(config_name, task)
    except InputError as error:
        sys.exit(refused(error))


def run_hydra(config_name: str, task: Callable[[DictConfig], None]) -> None:
    """Run a task by Hydra, once or for each job of many.

    Raises
    ------
    InputError : the command line is wrong, or a folder cannot be written to
    """
    arguments = sys.argv[1:] = quoted(sys.argv[1:])
    os.environ["HYDRA_FULL_ERROR"] = "1"  # otherwise Hydra prints several lines and exits
    for word in get_args_parser().parse_known_args(arguments)[1]:
        if word.startswith("-"):
            name = word.lstrip("-").partition("=")[0]
            raise InputError(f"unknown flag {word}; options are given as {name}=value")
    main = hydra.main(version_base="1.3", config_path=str(HOME / "conf"), config_name=config_name)
    try:
        main(task)()
    except HydraException as error:
        raise refusal(error) from None
    except OSError as error:  # of a file that is written by Hydra or TensorBoard
        if error.errno not in manifest.UNWRITABLE:
            raise
        raise InputError(str(error.strerror), error.filename or "the results folder") from None


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
