"""The voxels of the primitives chosen."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from polycube import registry
from polycube.errors import InputError


def voxels(names: Iterable[str]) -> dict[str, np.ndarray]:
    """(3, 3, 3) bool of each primitive; raises InputError for one that is something else."""
    made = {}
    for name in names:
        found = made[name] = np.asarray(registry.build("primitive", {"plugin": name})())
        if found.shape != (3, 3, 3) or found.dtype != bool:
            raise InputError(
                f"primitive {name} must be 3 x 3 x 3 voxels, True where they are full; got "
                f"{found.dtype} of shape {found.shape}"
            )
    return made
