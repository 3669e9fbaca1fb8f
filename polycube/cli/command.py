"""Commands: Hydra reads arguments, composes the configuration, and runs a job; errors become exit
codes.
"""

import atexit
import gc
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from os.path import isdir, isfile, lexists  # unlike those of Path, they accept long names
from pathlib import Path

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.core.plugins import Plugins
from hydra.errors import HydraException
from hydra.experimental.callback import Callback
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from polycube import HOME
from polycube.config import SHORT, PluginConfigs, plain, quote, refusal
from polycube.errors import InputError, printable
from polycube.io import manifest
from polycube.io.access.lock import locked
from polycube.kinds import KINDS
from polycube.types import Json

PATHS = ("mesh", "hex", "output_dir", "resume", "ckpt", "begin_from", "data.path")
OTHER_FOLDER = "choose another hydra.run.dir, or move the file away"

# from arguments to the flags of Hydra with their `overrides`, and the unknown flags
split = get_args_parser().parse_known_args

_locks = ExitStack()  # of the folder of a multirun, until the end of the process
atexit.register(_locks.close)

Plugins.instance().register(PluginConfigs)


def command(config_name: str, job: Callable[[Json, Path], Json]) -> None:
    """Run `job(config, output folder)` of a command line.

    An `InputError` or an error of the configuration is printed in one line; the exit code is 2. A
    sweeper receives the "error" among the numbers of the job, as the value to minimise.
    """

    def task(cfg: DictConfig) -> object:
        folder = Path(HydraConfig.get().runtime.output_dir)
        if folder.is_relative_to(Path.cwd()):
            folder = folder.relative_to(Path.cwd())  # as the user would write it
        with refusing():  # here, because Hydra would print a line of its own
            return job(plain(cfg, throw_on_missing=True), folder).get("error")

    with refusing():
        run_hydra(config_name, task)


def run_hydra(config_name: str, task: Callable[[DictConfig], object]) -> None:
    """Run a task with Hydra, once or for each job of a multirun.

    Raises InputError if the command line is wrong, or if a folder is not writable.
    """
    arguments = sys.argv[1:] = [*quoted(sys.argv[1:])]
    os.environ["HYDRA_FULL_ERROR"] = "1"  # otherwise Hydra prints several lines and exits
    for flag in split(arguments)[1]:
        if flag.startswith("-"):
            name = flag.lstrip("-").partition("=")[0]
            raise InputError(f"unknown flag {flag}; options are given as {name}=value")

    if not gc.isenabled():  # see `polycube.cli`
        gc.freeze()  # existing objects stay until the end
        gc.enable()
    main = hydra.main(version_base="1.3", config_path=str(HOME / "conf"), config_name=config_name)
    try:
        main(task)()
    except HydraException as error:
        raise refusal(error) from None
    except OSError as error:  # from files of Hydra and TensorBoard
        if error.errno not in manifest.UNWRITABLE:
            raise
        raise InputError(str(error.strerror), error.filename or "the results folder") from None


class Sweep(Callback):
    """The folder of a multirun in Hydra, with `multirun.yaml`, which Hydra would just overwrite."""

    files: tuple[str, ...] = ()  # names of other files that will be written to the folder

    def on_multirun_start(self, config: DictConfig, **_: object) -> None:
        """Refuse a folder in which a file of the user would be overwritten."""
        folder = Path(config.hydra.sweep.dir)
        with refusing():  # Hydra catches all exceptions of a callback
            _locks.enter_context(locked(folder))
            manifest.check(folder, self.files)
            with manifest.writing(folder) as scratch:
                OmegaConf.save(config, scratch / "multirun.yaml")


@contextmanager
def refusing() -> Iterator[None]:
    """Print an error of the input or configuration in one line, and end with exit code 2."""
    try:
        yield
    except (InputError, OmegaConfBaseException) as error:
        sys.exit(refused(error))


def refused(error: Exception | str) -> int:
    """Print an error to standard error in one line; returns the exit code 2."""
    sys.stderr.write(f"error: {printable(' '.join(str(error).split()))}\n")
    return 2


def with_input(arguments: list[str]) -> list[str]:
    """Read the only argument that is the name of a part as the value of `mesh=` or `hex=`.

    Returns all arguments. A file, a folder, a pattern, `example:NAME` and a name with the suffix of
    a part get the prefix `mesh=`, a hex mesh gets `hex=`. The arguments are unchanged if there are
    several such names, or if an input is given already.

    arguments : of the command line, without the name of the program
    """
    from polycube.io.hex_meshes import FORMATS
    from polycube.io.surfaces import KNOWN

    overrides = split(arguments)[0].overrides
    bare = [each for each in overrides if _is_part(each, (*KNOWN, *FORMATS))]
    key = "hex=" if bare and bare[0].lower().endswith(FORMATS) else "mesh="
    if len(bare) != 1 or any(each.startswith(key) for each in overrides):
        return arguments
    value = key + (quote(bare[0]) if "${" in bare[0] else bare[0])
    return [value if each == bare[0] else each for each in arguments]


def _is_part(argument: str, suffixes: tuple[str, ...]) -> bool:
    is_named = argument.startswith("example:") or argument.lower().endswith(suffixes)
    are_several = isdir(argument) or any(sign in argument for sign in "*?")
    return isfile(argument) or ("=" not in argument and (is_named or are_several))


def in_full(arguments: list[str]) -> list[str]:
    """All arguments, with the full names of options for short ones such as `size=3`."""
    parts = (argument.partition("=") for argument in arguments)
    return [(SHORT.get(name, name) if sign else name) + sign + value for name, sign, value in parts]


def quoted(arguments: list[str]) -> Iterator[str]:
    """The arguments, with quotes around paths that Hydra does not read literally: # , or ${.

    Numbers in place of the name of a choice are quoted, too, so that they are refused like a name.
    """
    for argument in arguments:
        name, _, text = argument.partition("=")
        is_file = ("${" in text or "," in text) and lexists(text)
        override = parsed(argument)
        is_misread = name in PATHS and (is_file or override is None)
        if override and (name in KINDS or isdir(HOME / "conf" / name)):
            is_misread = isinstance(override.value(), int | float | None)
        yield f"{name}={quote(text)}" if is_misread else argument


def parsed(argument: str) -> Override | None:
    """An argument as Hydra reads it; None if it cannot be read."""
    try:
        return OverridesParser.create().parse_overrides([argument])[0]
    except HydraException:
        return None
