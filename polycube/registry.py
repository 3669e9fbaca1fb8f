"""Find plugins and build them by name.

A plugin is a frozen dataclass of its options, registered under a kind and a name.  The class is
the only place that says which options there are: names, types and defaults are its fields, the
help is the `Parameters` section of its docstring.  The kind is also its Hydra group and its folder:
`meshing/smooth=register` chooses what `plugins/meshing/smooth.py` registers as ("meshing/smooth",
"register").

Plugins come from the `plugins/` folder and from every installed distribution with an entry point
in the group "polycube.plugins".
"""

from __future__ import annotations

import difflib
import importlib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, field, fields, is_dataclass, replace
from functools import cache
from importlib.metadata import entry_points
from numbers import Integral, Real
from types import ModuleType
from typing import Any

from polycube.errors import BadOption, UnknownPlugin
from polycube.kinds import KINDS

GROUP = "polycube.plugins"  # entry-point group, and the name `plugins/` is imported under

REQUIRED = "???"  # value of an option without a default
PROVIDED = {"structure": ("grid", "primitives")}  # options that a run provides, not a configuration
BY_RUN = {"given": "by the run"}  # metadata of a field that `provide` fills in
PLAIN = {  # annotations that are checked: what they admit, in code and in words
    "bool": (bool, "true or false"),
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "str": (str, "a word"),
}

_classes: dict[tuple[str, str], type] = {}
_broken: dict[str, Exception] = {}  # entry point -> why it did not import


def register(kind: str, name: str) -> Callable[[type], type]:
    """Make the decorated class available as `plugin: name` in group `kind`.

    Raises ValueError for an unknown kind and for a name that is taken.
    """
    if kind not in KINDS:
        raise ValueError(f"unknown plugin kind {kind!r}; kinds are {', '.join(KINDS)}")

    def add(cls: type) -> type:
        old = _classes.setdefault((kind, name), cls)
        if old is not cls:
            raise ValueError(
                f"{kind} plugin {name!r} is registered twice: by "
                f"{old.__module__}.{old.__qualname__} and {cls.__module__}.{cls.__qualname__}"
            )
        return cls

    return add


def setting(name: str, default: object) -> Any:
    """Declare an option whose default is a setting of the run.

    Parameters
    ----------
    name : of the setting, such as "seed" or "meshing.size"
    default : where the configuration has no such setting
    """
    return field(default=default, metadata={"setting": name})


def provide(plugin: Any, **values: object) -> Any:
    """The plugin with those of the values that it declares by `field(metadata=BY_RUN)`."""
    asked = [f.name for f in fields(plugin) if f.metadata == BY_RUN and f.name in values]
    return replace(plugin, **{name: values[name] for name in asked})


def choice(kind: str, name: str) -> Any:
    """Declare an option that is a plugin of another kind; `name` is the default."""
    return field(default_factory=lambda: {"plugin": name}, metadata={"choice": (kind, name)})


def options(kind: str, cls: type) -> dict[str, Field]:
    """Fields of a plugin class that a configuration may set, by name."""
    given = PROVIDED.get(kind, ())
    return {
        f.name: f for f in fields(cls) if f.init and f.name not in given and f.metadata != BY_RUN
    }


def default(option: Field) -> object:
    """Default of an option; "???" where it has none."""
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
    """Build the plugin that `config["plugin"]` names, with the other entries as its options.

    Raises UnknownPlugin with the names that exist, BadOption with the options it takes.
    """
    values = {**config, **extra}
    if "plugin" not in values:
        raise UnknownPlugin(f"{kind} config names no plugin; have {', '.join(names(kind))}")
    name = str(values.pop("plugin"))
    cls = classes().get((kind, name))
    if cls is None:
        raise UnknownPlugin(_unknown(kind, name))
    try:
        inspect.signature(cls).bind(**values)
    except TypeError as error:
        raise BadOption(f"{kind}={name}: {error}; it takes {inspect.signature(cls)}") from None
    _check_types(f"{kind}={name}", cls, values)
    try:
        return cls(**values)
    except (TypeError, ValueError) as error:
        raise BadOption(f"{kind}={name}: {error}") from error


def _check_types(plugin: str, cls: type, values: Mapping[str, object]) -> None:
    """Raise BadOption for an option of plain types that has a value of another type."""
    types = {f.name: f.type for f in fields(cls)} if is_dataclass(cls) else {}
    for name, value in values.items():
        if isinstance(value, str) and value == REQUIRED:
            raise BadOption(f"{plugin}: {name} must be given")
        annotation = types.get(name)  # a text, where its module postpones annotations
        plain = annotation.__name__ if isinstance(annotation, type) else str(annotation)
        admitted, words = PLAIN.get(plain, (object, ""))
        truth = isinstance(value, bool) and plain != "bool"  # which Python counts as a number
        if not isinstance(value, admitted) or (truth and plain in PLAIN):
            raise BadOption(f"{plugin}: {name} must be {words}; got {value!r}")


@cache
def _discover() -> None:
    _import_all(importlib.import_module(GROUP))
    for entry in entry_points(group=GROUP):
        try:
            _import_all(entry.load())
        except Exception as error:  # a stranger's bug must not stop runs that do not use it
            _broken[entry.name] = error


def _import_all(package: ModuleType) -> None:
    """Import the modules that register plugins; what these need is imported when they run."""
    for module in pkgutil.walk_packages(getattr(package, "__path__", []), package.__name__ + "."):
        spec = module.module_finder.find_spec(module.name, None)
        source = getattr(spec and spec.loader, "get_source", lambda name: None)(module.name)
        if source is None or "register(" in source:
            importlib.import_module(module.name)


def _unknown(kind: str, name: str) -> str:
    message = f"no {kind} plugin named {name!r}; have {', '.join(names(kind)) or 'none'}"
    close = difflib.get_close_matches(name, names(kind), n=1)
    return message + (f". Did you mean {close[0]!r}?" if close else "") + broken()


def broken() -> str:
    """Plugin packages that could not be imported, and why; empty where all could."""
    _discover()
    packages = (f" (plugin package {p!r} did not import: {e!r})" for p, e in _broken.items())
    return "".join(packages)
