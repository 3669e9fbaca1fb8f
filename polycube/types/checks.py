"""Checks of array shapes and types in the constructors of the data types."""

from __future__ import annotations

import numpy as np


def freeze(obj: object, **specs: tuple[str, type]) -> None:
    """Check array fields and make them read-only; equal letters mean equal lengths.

    specs : field name -> (dimensions such as "V 3", dtype); raises ValueError for another shape
    """
    sizes: dict[str, int] = {}
    for name, (dims, dtype) in specs.items():
        array: np.ndarray = np.array(getattr(obj, name), dtype=dtype)  # own copy
        letters = dims.split()
        wanted = f"{type(obj).__name__}.{name} must have shape ({', '.join(letters)})"
        if array.ndim != len(letters):
            raise ValueError(f"{wanted}; got {array.shape}")
        for letter, size in zip(letters, array.shape, strict=True):
            if sizes.setdefault(letter, int(letter) if letter.isdigit() else size) != size:
                same = "" if letter.isdigit() else f" with {letter}={sizes[letter]}"
                raise ValueError(f"{wanted}{same}; got {array.shape}")
        array.flags.writeable = False
        object.__setattr__(obj, name, array)
