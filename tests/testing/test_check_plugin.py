"""Every plugin of this program meets the requirements of its kind; other objects are refused."""

from dataclasses import dataclass

import numpy as np
import pytest

from polycube.kinds import KINDS
from polycube.registry import names
from polycube.testing import CHECKS, check, check_plugin
from tests.testing.broken import broken

CUBE = {"context": ["cube"]}
NEEDED = {("structure", "given"): CUBE, ("structure", "paper"): CUBE}  # options that must be given
LONG = {("model", "transformer"), ("model", "unet"), ("model", "points")}  # large networks
LONG |= {("structure", name) for name in names("structure") if name != "slices"}
LONG |= {("meshing/map", "harmonic"), ("meshing/segment", "drawn"), ("spline", "auto")}
ELSEWHERE = {"parts"}  # without files it does nothing: see its own test


def test_every_kind_has_a_check() -> None:
    assert set(CHECKS) == set(KINDS)


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        pytest.param(kind, name, marks=pytest.mark.slow if (kind, name) in LONG else ())
        for kind in KINDS
        for name in names(kind)
        if name not in ELSEWHERE
    ],
)
def test_our_own_plugins_conform(kind: str, name: str) -> None:
    check_plugin(kind, {"plugin": name, **NEEDED.get((kind, name), {})})


def test_unknown_kind() -> None:
    with pytest.raises(LookupError, match="no plugin kind 'scheduler'; kinds are primitive"):
        check("scheduler", broken(lambda: None))


def test_a_plugin_is_a_frozen_dataclass_with_call() -> None:
    class Plain:
        def __call__(self) -> np.ndarray:
            return np.array([1.0, 0.5])

    with pytest.raises(AssertionError, match="frozen dataclass"):
        check("schedule", Plain())
    with pytest.raises(AssertionError, match="frozen dataclass"):
        check("schedule", dataclass(Plain)())
    with pytest.raises(AssertionError, match="has __call__"):
        check("schedule", dataclass(frozen=True)(type("Silent", (), {}))())
