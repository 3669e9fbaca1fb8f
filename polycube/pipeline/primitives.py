"""The voxels of the selected primitives."""

from collections.abc import Iterable

import numpy as np

from polycube import registry
from polycube.errors import InputError
from polycube.structure.primitives import Item, primitive_config, primitive_name


def voxels(items: Iterable[Item]) -> dict[str, np.ndarray]:
    """Build primitives.

    Returns voxels (3, 3, 3) bool of each primitive by its name, see `primitive_name`. Raises
    InputError if a plugin returns something else, or if two primitives have the same name.

    items : names such as "hole_x", or {plugin: name, option: value, ...}
    """
    made: dict[str, np.ndarray] = {}
    for item in items:
        name = primitive_name(item)
        if name in made:
            raise InputError(f"primitives.use contains {name} twice")
        found = made[name] = np.asarray(registry.build("primitive", primitive_config(item))())
        if found.shape != (3, 3, 3) or found.dtype != bool:
            got = f"{found.dtype} of shape {found.shape}"
            what = f"primitive {name} must be 3 x 3 x 3 voxels, True where they are full"
            raise InputError(f"{what}; got {got}")
    return made
