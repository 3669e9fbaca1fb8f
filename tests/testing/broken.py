"""Plugins that violate a requirement, and the assertion that the check reports it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from polycube.testing import check


def broken(function: Callable) -> object:
    """A plugin that calls the function."""
    cls = type("Broken", (), {"__call__": staticmethod(function)})
    return dataclass(frozen=True)(cls)()


def assert_refused(kind: str, function: Callable, message: str) -> None:
    """Assert that the check of the kind refuses the function with the message."""
    with pytest.raises(AssertionError, match=message):
        check(kind, broken(function))


def voxels(*empty: tuple[int, int, int]) -> np.ndarray:
    """A full cell but for some voxels."""
    full = np.ones((3, 3, 3), bool)
    for place in empty:
        full[place] = False
    return full
