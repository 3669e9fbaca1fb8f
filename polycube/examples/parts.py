"""Example parts, similar to those of the paper, lengths in mm."""

from functools import cache
from pathlib import Path

import numpy as np

from polycube.errors import InputError
from polycube.types import TriMesh

EXAMPLES = ("dice", "ring", "rod", "lantern", "eight", "key", "barrel", "cup")


@cache
def example(name: str) -> TriMesh:
    """Closed, smooth, regular triangulation of an example; raises InputError with the names."""
    if name not in EXAMPLES:
        raise InputError(f"no example named {name!r}; have {', '.join(EXAMPLES)}")
    with np.load(Path(__file__).with_name(f"{name}.npz")) as arrays:
        return TriMesh(arrays["vertices"], arrays["faces"])
