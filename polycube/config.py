"""Compose a configuration from the YAML files of `conf/` and the options of the plugin classes.

The dataclass of a plugin is its schema; `conf/` has no file for it. A YAML file combines plugins,
as `conf/meshing/morph.yaml` does, or selects values.

Private classes of Hydra are needed, because its public functions and its store of configurations
are the global state of a Hydra program that runs in the same process.
"""

import json
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from difflib import get_close_matches
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.config_search_path_impl import ConfigSearchPathImpl
from hydra._internal.core_plugins.structured_config_source import StructuredConfigSource
from hydra.core.config_loader import ConfigLoader
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.config_store import ConfigStore
from hydra.core.override_parser.types import Quote, QuotedString
from hydra.core.plugins import Plugins
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from hydra.plugins.config_source import ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from hydra.types import RunMode
from omegaconf import Container, DictConfig, OmegaConf, errors

from polycube import HOME
from polycube.errors import InputError
from polycube.hexmesh.settings import MeshingSettings
from polycube.registry import GROUP, broken, classes, default, options

SHARED = {("meshing", "_settings"): MeshingSettings}  # schemas that do not belong to a plugin
SHORT = {"size": "meshing.size", "material": "analysis.material"}  # short names of options
SEVERAL = ("export",)  # kinds with several plugins in a run; each has its name in the configuration

_ONE_AT_A_TIME = threading.Lock()  # the parser of Hydra has a state shared by threads


def compose(config_name: str = "infer", overrides: Sequence[str] = ()) -> dict[str, Any]:
    """Compose `conf/<config_name>.yaml` with overrides, as the command line does.

    The global state of Hydra is neither read nor changed, so the function can be used inside
    another Hydra program, in a notebook and in a thread. All interpolations are resolved; a missing
    mandatory value is "???". Raises InputError if an override has an unknown option, or a value
    that Hydra cannot read.

    config_name : name of a file in `conf/`, such as "infer", "train", "evaluate"
    overrides : in the syntax of Hydra, such as "meshing.size=4%" or "export=[abaqus,gmsh]"
    """
    named = [*overrides, "hydra.job.name=polycube"]  # otherwise taken from a running program
    try:
        with _ONE_AT_A_TIME:
            cfg = loader().load_configuration(config_name, named, RunMode.RUN, from_shell=False)
            return plain(OmegaConf.masked_copy(cfg, [str(name) for name in cfg if name != "hydra"]))
    except (HydraException, errors.OmegaConfBaseException) as error:
        raise refusal(error) from None


def quote(text: str) -> str:
    """Text as a string of Hydra that is taken literally, without interpolation."""
    text = re.sub(r"(\\*)\$\{", lambda found: 2 * found[1] + "\\${", text)
    return QuotedString(text, Quote.single).with_quotes()


def literal(value: object) -> str:
    """A value in Hydra's syntax; text is taken literally, as by `quote`."""
    if value is None:
        return "null"
    if isinstance(value, bool | int | float):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{key}:{literal(value[key])}" for key in value) + "}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ",".join(map(literal, value)) + "]"
    return quote(str(value))


def plain(cfg: DictConfig, throw_on_missing: bool = False) -> dict[str, Any]:
    """The settings as dictionaries, lists and plain values, all interpolations resolved."""
    values: Any = OmegaConf.to_container(cfg, resolve=True, throw_on_missing=throw_on_missing)
    return dict(values)


@cache
def loader() -> ConfigLoader:
    """Hydra's loader for this configuration."""
    path = ConfigSearchPathImpl()
    path.append("hydra", "pkg://hydra.conf")
    path.append("main", f"file://{HOME / 'conf'}")
    PluginConfigs().manipulate_search_path(path)
    path.append("schema", "structured://")
    return ConfigLoaderImpl(path)


def options_of(search: ConfigLoader, group: str) -> list[str]:
    """Names that can be chosen in a group; those with an underscore are parts of others."""
    return [name for name in search.get_group_options(group) if not name.startswith("_")]


class PluginConfigs(SearchPathPlugin):
    """Adds the plugin classes and the `conf/` folders of plugin packages to Hydra's search path.

    Those of this program come first: a package can add choices, but not replace existing ones.
    """

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Append the sources."""
        Plugins.instance().register(PluginSource)
        search_path.append("polycube", f"{PluginSource.scheme()}://plugins")
        for entry in entry_points(group=GROUP):
            spec = find_spec(entry.module.partition(".")[0])  # searches without importing
            for folder in (spec and spec.submodule_search_locations) or []:
                if (conf := Path(folder) / "conf").is_dir():
                    search_path.append(f"polycube:{entry.name}", f"file://{conf}")


class PluginSource(StructuredConfigSource):
    """The default options of all plugin classes, as if each had a YAML file.

    They are in a store of their own, because other programs in the process see that of Hydra.
    """

    def __init__(self, provider: str, path: str) -> None:
        ConfigSource.__init__(self, provider, path)
        self.store = type.__call__(ConfigStore)  # a new one, not the singleton
        for (kind, name), cls in {**SHARED, **classes()}.items():
            place = f"{kind}.{name}" if kind in SEVERAL else None
            self.store.store(name, _defaults(kind, name, cls), kind, place)

    @staticmethod
    def scheme() -> str:
        """Scheme of the address of this source."""
        return "polycube"


def _defaults(kind: str, name: str, cls: type) -> dict[str, object]:
    """The default options of a plugin as YAML values."""
    values: dict[str, object] = {} if (kind, name) in SHARED else {"plugin": name}
    choices = []
    for option in options(kind, cls).values():
        value = json.dumps(default(option), default=asdict)
        if "choice" in option.metadata:
            group, chosen = option.metadata["choice"]
            choices.append({f"/{group}@{option.name}": chosen})
        elif "setting" in option.metadata:
            values[option.name] = f"${{oc.select:{option.metadata['setting']},{value}}}"
        else:
            values[option.name] = json.loads(value)
    return {"defaults": [*choices, "_self_"], **values}


def refusal(error: Exception) -> InputError:
    """Error of Hydra or OmegaConf as an InputError of one line, with a similar valid name."""
    cause = error.__cause__ or error
    if isinstance(error, MissingConfigException) and "/" in str(error.missing_cfg_file):
        group, _, name = str(error.missing_cfg_file).rpartition("/")
        have = options_of(loader(), group)
        near = _did_you_mean(get_close_matches(name, have, 1, 0.5))
        what = "there is no such choice"
        return InputError(what, f"{group}={name}", f"{near}have {', '.join(have)}{broken()}")
    if isinstance(error, OverrideParseException):
        wrong = str(error).splitlines()[0] if "=" in error.override else "it has no ="
        remedy = "write name=value, lists as 'a=[1,2]'"
        return InputError(f"{error.override!r} cannot be read: {wrong}", remedy=remedy)
    if isinstance(cause, errors.ConfigTypeError) and "=" in str(error):  # the value of an override
        name, given, kind = str(cause.full_key), str(error).partition("=")[2], cause.object_type
        what, right = ("list", f"[{given}]") if kind is list else ("mapping", "{name: value}")
        return InputError(f"must be a {what}; got {given}", name, f"write '{name}={right}'")
    missing = errors.ConfigAttributeError, errors.ConfigKeyError
    if isinstance(cause, missing) and cause.parent_node is not None:
        return _no_option(str(cause.full_key), cause.parent_node)
    return InputError(" ".join(str(cause).split()))


def _no_option(name: str, parent: Container) -> InputError:
    """Error for an option that its parent does not have."""
    group, _, last = name.rpartition(".")
    siblings = list(parent) if group and isinstance(parent, DictConfig) else []
    root: Any = OmegaConf.to_container(parent._get_root())  # OmegaConf has no public way up
    root.pop("hydra", None)
    known = sorted((known for known, _ in by_name(root)), key=lambda known: known.count("."))
    same = [other for other in known if other.rpartition(".")[2] == last]  # meshing.size for size
    shortest = [other for other in same if other.count(".") == same[0].count(".")]
    near = shortest or get_close_matches(name, [*SHORT, *known], 1, 0.5)
    have = f"{group} has {', '.join(siblings)}" if siblings else "--help lists them"
    return InputError(f"there is no option {name}", remedy=_did_you_mean(near) + have)


def _did_you_mean(names: Sequence[str]) -> str:
    return f"did you mean {' or '.join(names)}; " if names else ""


def by_name(settings: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Full names and values of all groups and of their options."""
    for key, value in settings.items():
        yield f"{before}{key}", value
        if isinstance(value, Mapping):
            yield from by_name(value, f"{before}{key}.")
