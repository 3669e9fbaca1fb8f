"""Conformance checks for plugins, for the tests of their authors:

    from polycube.testing import check_plugin

    def test_quadratic():
        check_plugin("schedule", {"plugin": "quadratic", "steps": 100})

A violated requirement raises AssertionError with the kind and the value found.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

from polycube.kinds import KINDS
from polycube.registry import build
from polycube.testing.learning import LEARNING
from polycube.testing.search import SEARCH
from polycube.testing.solids import GRID, PRIMITIVES, claim
from polycube.testing.stages import STAGES

CHECKS = {**LEARNING, **SEARCH, **STAGES}

# arguments that the program, not the user, gives to plugins of a kind
GIVEN = {"structure": {"grid": GRID, "primitives": PRIMITIVES}}


def check_plugin(kind: str, config: Mapping[str, object], **extra: object) -> None:
    """Build a plugin as a run does and check it.

    Parameters
    ----------
    kind : kind of the plugin, such as "schedule"
    config : `plugin: name` and the options, as in the YAML file

    Raises
    ------
    AssertionError
        If the plugin violates a requirement of its kind.
    LookupError
        If the kind is unknown.
    """
    check(kind, build(kind, config, **{**GIVEN.get(kind, {}), **extra}))


def check(kind: str, plugin: Any) -> None:
    """Check a plugin object; raises the errors of `check_plugin`."""
    if kind not in CHECKS:
        raise LookupError(f"no plugin kind {kind!r}; kinds are {', '.join(KINDS)}")
    options = getattr(type(plugin), "__dataclass_params__", None)
    claim(options is not None and options.frozen, "a plugin is a frozen dataclass of its options")
    claim(dataclasses.is_dataclass(plugin) and callable(plugin), "a plugin has __call__")
    CHECKS[kind](plugin)
