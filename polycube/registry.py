"""Find plugins and build them by name.

A plugin is a class registered under a kind and a name.  The kind is also its Hydra group and its
folder: `conf/meshing/smooth/register.yaml` configures the class that `plugins/meshing/smooth.py`
registers as ("meshing/smooth", "register").

Plugins come from the `plugins/` folder and from every installed distribution with an entry point
in the group "polycube.plugins".
"""

from __future__ import annotations

import difflib
import importlib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import entry_points
from numbers import Integral, Real
from types import ModuleType
from typing import Any

from polycube.errors import BadOption, UnknownPlugin
from polycube.kinds import KINDS

GROUP = "polycube.plugins"  # entry-point group, and the name `plugins/` is imported under

MISSING = "???"  # what the YAML says where there is no default
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


def names(kind: str) -> list[str]:
    """Names of all plugins of a kind, sorted."""
    _discover()
    return sorted(name for k, name in _classes if k == kind)


def build(kind: str, config: Mapping[str, object], **extra: object) -> Any:
    """Build the plugin that `config["plugin"]` names, with the other entries as its options.

    Raises UnknownPlugin with the names that exist, BadOption with the options it takes.
    """
    _discover()
    options = {**config, **extra}
    if "plugin" not in options:
        raise UnknownPlugin(f"{kind} config names no plugin; have {', '.join(names(kind))}")
    name = options.pop("plugin")
    cls = _classes.get((kind, name))
    if cls is None:
        raise UnknownPlugin(_unknown(kind, name))
    try:
        inspect.signature(cls).bind(**options)
    except TypeError as error:
        raise BadOption(f"{kind}={name}: {error}; it takes {inspect.signature(cls)}") from None
    _check_types(f"{kind}={name}", cls, options)
    try:
        return cls(**options)
    except (TypeError, ValueError) as error:
        raise BadOption(f"{kind}={name}: {error}") from error


def _check_types(plugin: str, cls: type, options: Mapping[str, object]) -> None:
    """Raise BadOption for an option of a plain type that is given something else."""
    types = {field.name: field.type for field in fields(cls)} if is_dataclass(cls) else {}
    for name, value in options.items():
        if isinstance(value, str) and value == MISSING:
            raise BadOption(f"{plugin}: {name} must be given")
        annotation = types.get(name)  # a word, where its module postpones annotations
        plain = getattr(annotation, "__name__", annotation)
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
    for module in pkgutil.walk_packages(getattr(package, "__path__", []), package.__name__ + "."):
        importlib.import_module(module.name)


def _unknown(kind: str, name: str) -> str:
    message = f"no {kind} plugin named {name!r}; have {', '.join(names(kind)) or 'none'}"
    close = difflib.get_close_matches(name, names(kind), n=1)
    if close:
        message += f". Did you mean {close[0]!r}?"
    for package, error in _broken.items():
        message += f" (plugin package {package!r} did not import: {error!r})"
    return message
