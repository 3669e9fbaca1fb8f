"""Primitives in a configuration, a name or a name with options, and their voxels."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycube.errors import InputError

Item = str | Mapping[str, object]  # name of a plugin, or {plugin: name, option: value, ...}


@dataclass(frozen=True, kw_only=True, eq=False)
class OnGrid:
    """What a run gives to every structure plugin.

    grid : cells of the polycube along x, y, z
    primitives : (3, 3, 3) bool voxels by name
    """

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]


def primitive_config(item: Item) -> dict[str, object]:
    """Configuration of the plugin of a primitive."""
    if isinstance(item, Mapping) and "plugin" in item:
        return dict(item)
    if not isinstance(item, str):
        raise InputError(f"a primitive is a name or {{plugin: name, option: value}}; got {item!r}")
    return {"plugin": item}


def primitive_name(item: Item) -> str:
    """Name in contexts, weights and exported files: hole_x, or tee_stem_1 if there are options.

    Different primitives have different names, so that weights are used only with their own
    primitives.
    """
    config = primitive_config(item)
    options = (f"{key}_{value}" for key, value in config.items() if key != "plugin")
    return re.sub(r"\W+", "_", "_".join([str(config["plugin"]), *options]))


def full_cell(primitives: Mapping[str, np.ndarray]) -> str | None:
    """Name of the first primitive that fills its cell, of voxels by name; None if there is none."""
    return next((name for name, voxels in primitives.items() if voxels.all()), None)
