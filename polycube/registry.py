"""Registry of plugins: find them, and build them by name.

A plugin is a frozen dataclass of its options, registered with a kind and a name. The class is the
only definition of the options: names, types and defaults are its fields, and the help is the
`Parameters` section of its docstring. The kind is also the Hydra group and the folder:
`meshing/smooth=register` selects the class that `plugins/meshing/smooth.py` registers as
("meshing/smooth", "register").

Plugins are found in the `plugins/` folder and in every installed distribution with an entry point
in the group "polycube.plugins".
"""

import difflib
import importlib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, field, fields, replace
from functools import cache
from importlib.metadata import entry_points
from types import ModuleType
from typing import Any

from polycube.errors import BadOption, UnknownPlugin
from polycube.hexmesh.settings import MeshingSettings
from polycube.kinds import KINDS
from polycube.types.options import check_options

GROUP = "polycube.plugins"  # entry-point group, and import name of `plugins/`

REQUIRED = "???"  # value of an option without a default
# options provided by the run, not by the configuration
PROVIDED = {"structure": ("grid", "primitives")}
BY_RUN = {"given": "by the run"}  # metadata of a field that `provide` fills in

_classes: dict[tuple[str, str], type] = {}
_broken: dict[str, Exception] = {}  # error of each entry point that could not be imported


def register(kind: str, name: str) -> Callable[[type], type]:
    """Register the decorated class, which is not changed, as `plugin: name` in group `kind`.

    Raises ValueError if the kind is unknown or the name is already registered.

    kind : kind of the plugin, one of `polycube.kinds.KINDS`
    name : unique name in its kind
    """
    if kind not in KINDS:
        raise ValueError(f"unknown plugin kind {kind!r}; kinds are {', '.join(KINDS)}")

    def add(cls: type) -> type:
        old = _classes.setdefault((kind, name), cls)
        if old is not cls:
            one, other = (f"{each.__module__}.{each.__qualname__}" for each in (old, cls))
            raise ValueError(f"{kind} plugin {name!r} is registered twice: by {one} and {other}")
        return cls

    return add


def setting(name: str, default: object = MISSING) -> Any:
    """Declare an option whose default is a setting of the run.

    name : name of the setting, such as "seed" or "meshing.size"
    default : value if the configuration does not have the setting; may be omitted for `meshing.*`
    """
    if default is MISSING:
        default = getattr(MeshingSettings, name.removeprefix("meshing."))
    return field(default=default, metadata={"setting": name})


def provide(plugin: Any, **values: object) -> Any:
    """The plugin with the values for the fields that it declares by `field(metadata=BY_RUN)`."""
    declared = [f.name for f in fields(plugin) if f.metadata == BY_RUN and f.name in values]
    return replace(plugin, **{name: values[name] for name in declared})


def choice(kind: str, name: str) -> Any:
    """Declare an option that is a plugin of another kind; by default the one with this name."""
    return field(default_factory=lambda: {"plugin": name}, metadata={"choice": (kind, name)})


def options(kind: str, cls: type) -> dict[str, Field]:
    """Fields of a plugin class that a configuration can set, by name."""
    given = PROVIDED.get(kind, ())
    chosen = (f for f in fields(cls) if f.init and f.name not in given and f.metadata != BY_RUN)
    return {f.name: f for f in chosen}


def default(option: Field) -> object:
    """Default of an option; "???" if there is none."""
    if option.default_factory is not MISSING:
        return option.default_factory()
    return REQUIRED if option.default is MISSING else option.default


def classes() -> Mapping[tuple[str, str], type]:
    """All plugin classes by kind and name."""
    _discover()
    return _classes


def names(kind: str) -> list[str]:
    """Names of all plugins of a kind, sorted."""
    return sorted(name for k, name in classes() if k == kind)


def build(kind: str, config: Mapping[str, object], **extra: object) -> Any:
    """Build the plugin named by `config["plugin"]`, with the other entries as its options.

    Raises UnknownPlugin if there is no plugin of this name; the message lists the existing ones.
    Raises BadOption if an option is unknown or has an invalid value; the message lists the options.

    kind : kind of the plugin, such as "meshing/smooth"
    config : name and options of the plugin
    """
    values = {**config, **extra}
    name, have = str(values.pop("plugin", "")), names(kind)
    if name not in have:
        what = f"no {kind} plugin named {name!r}" if name else f"{kind} config names no plugin"
        close = difflib.get_close_matches(name, have, n=1)
        hint = f". Did you mean {close[0]!r}?" if close else ""
        raise UnknownPlugin(f"{what}; have {', '.join(have) or 'none'}{hint}{broken()}")
    cls = classes()[kind, name]
    try:
        inspect.signature(cls).bind(**values)
    except TypeError as error:
        raise BadOption(f"{kind}={name}: {error}; it takes {inspect.signature(cls)}") from None
    try:
        for option, value in values.items():
            if isinstance(value, str) and value == REQUIRED:
                raise TypeError(f"{option} must be given")
        check_options(cls, values)
        return cls(**values)
    except (TypeError, ValueError) as error:
        raise BadOption(f"{kind}={name}: {error}") from error


@cache
def _discover() -> None:
    _import_all(importlib.import_module(GROUP))
    for entry in entry_points(group=GROUP):
        try:
            _import_all(entry.load())
        # an error in another package must not stop runs that do not use it
        except Exception as error:
            _broken[entry.name] = error


def _import_all(package: ModuleType) -> None:
    """Import the modules that register plugins; their dependencies are imported at use."""
    for module in pkgutil.walk_packages(getattr(package, "__path__", []), package.__name__ + "."):
        spec = module.module_finder.find_spec(module.name, None)
        source = getattr(spec and spec.loader, "get_source", lambda name: None)(module.name)
        if source is None or "register(" in source:
            importlib.import_module(module.name)


def broken() -> str:
    """Plugin packages that could not be imported, with the reasons; empty if there are none."""
    return "".join(f" (plugin package {p!r} did not import: {e!r})" for p, e in _broken.items())
