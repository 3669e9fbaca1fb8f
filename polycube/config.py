"""Compose a configuration from the YAML files of `conf/` and the options of the plugin classes.

The dataclass of a plugin is its schema: `conf/` holds no file for it.  A YAML file combines
plugins, as `conf/meshing/morph.yaml` does, or chooses values.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.config_search_path_impl import ConfigSearchPathImpl
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.plugins import Plugins
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from hydra.types import RunMode
from omegaconf import Container, DictConfig, OmegaConf, open_dict
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException

from polycube import HOME
from polycube.errors import InputError
from polycube.registry import GROUP

_ONE_AT_A_TIME = threading.Lock()  # Hydra's parser keeps state that threads would share


def compose(config_name: str = "infer", overrides: Sequence[str] = ()) -> dict[str, object]:
    """Compose `conf/<config_name>.yaml` with overrides, as the command line does.

    Hydra's global state is neither read nor changed, so that this works inside another Hydra
    program, in a notebook and in a thread.

    Parameters
    ----------
    config_name : name of a file in `conf/`, such as "infer", "train", "evaluate"
    overrides : in Hydra's syntax, such as "meshing.size=4%" or "export=[abaqus,gmsh]"

    Returns
    -------
    The settings with all interpolations resolved; "???" where a value is mandatory and missing.

    Raises
    ------
    InputError : an override names no option, or has a value that Hydra cannot read
    """
    named = [*overrides, "hydra.job.name=polycube"]  # otherwise taken from a running program
    try:
        with _ONE_AT_A_TIME:
            cfg = loader().load_configuration(config_name, named, RunMode.RUN, from_shell=False)
            with open_dict(cfg):
                del cfg["hydra"]
            return OmegaConf.to_container(cfg, resolve=True, throw_on_missing=False)
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(sentence(error)) from None


def loader() -> ConfigLoaderImpl:
    """Hydra's loader of our configuration; the only use of its private modules."""
    Plugins.instance()  # makes known how files and packages are read
    path = ConfigSearchPathImpl()
    path.append("hydra", "pkg://hydra.conf")
    path.append("main", f"file://{HOME / 'conf'}")
    add_sources(path)
    path.append("schema", "structured://")
    return ConfigLoaderImpl(path)


def add_sources(search_path: ConfigSearchPath) -> None:
    """Append the `conf/` folder of every installed plugin package.

    Ours come first: a package can add choices, but not replace ours.
    """
    for entry in entry_points(group=GROUP):
        spec = find_spec(entry.module.partition(".")[0])  # finds, does not import
        for folder in (spec and spec.submodule_search_locations) or []:
            if (conf := Path(folder) / "conf").is_dir():
                search_path.append(f"polycube:{entry.name}", f"file://{conf}")


def sentence(error: Exception) -> str:
    """What Hydra or OmegaConf raised, on one line, with the nearest name that would be right."""
    cause = error.__cause__ or error
    if isinstance(error, MissingConfigException) and "/" in str(error.missing_cfg_file):
        group, _, name = str(error.missing_cfg_file).rpartition("/")
        have = error.options or loader().get_group_options(group)
        return (
            f"{group}={name}: there is no such choice{_did_you_mean(name, have)}; "
            f"have {', '.join(have)}"
        )
    if isinstance(error, OverrideParseException):
        wrong = str(error).splitlines()[0] if "=" in error.override else "it has no ="
        return f"{error.override!r} can not be read: {wrong}; write name=value, lists as 'a=[1,2]'"
    if isinstance(cause, ConfigAttributeError | ConfigKeyError) and cause.parent_node is not None:
        return _no_option(cause.full_key, cause.parent_node)
    return " ".join(str(cause).split())


def _no_option(name: str, parent: Container) -> str:
    """What to say of an option that its parent does not have."""
    group, _, last = name.rpartition(".")
    beside = list(parent) if group and isinstance(parent, DictConfig) else []
    known = list(_names(parent._get_root()))
    elsewhere = [other for other in known if other.rpartition(".")[2] == last]  # meshing.size
    near = (
        _did_you_mean(name, [f"{group}.{key}" for key in beside])
        or _did_you_mean(name, elsewhere, 0.0)
        or _did_you_mean(name, known)
    )
    have = f"; {group} has {', '.join(beside)}" if beside else ""
    return f"there is no option {name}{near}{have or '; --help lists them'}"


def _did_you_mean(name: str, known: Sequence[str], cutoff: float = 0.5) -> str:
    found = get_close_matches(name, known, 1, cutoff)
    return f", did you mean {found[0]}" if found else ""


def _names(config: DictConfig, before: str = "") -> Iterator[str]:
    """Full names of all options, and of the groups they are in."""
    for key in config:
        if not before and key == "hydra":
            continue
        yield f"{before}{key}"
        node = config._get_node(key)
        if isinstance(node, DictConfig) and not node._is_none() and not node._is_interpolation():
            yield from _names(node, f"{before}{key}.")
