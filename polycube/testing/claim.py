"""Assertions of the conformance checks."""

import numpy as np


def claim(holds: bool | np.bool_, requirement: str, found: object = None) -> None:
    """Raise AssertionError with the requirement and the value found if it does not hold."""
    if not holds:
        raise AssertionError(requirement if found is None else f"{requirement}; got {found}")


def claim_array(value: object, dims: tuple[int | None, ...], what: str) -> None:
    """Require a finite numpy array with the sizes `dims`; None allows any size."""
    if not isinstance(value, np.ndarray):
        raise AssertionError(f"{what} is a numpy array; got {type(value).__name__}")
    fits = value.ndim == len(dims) and all(
        d in (None, n) for d, n in zip(dims, value.shape, strict=True)
    )
    wanted = ", ".join("any" if d is None else str(d) for d in dims)
    claim(fits, f"{what} has shape ({wanted})", value.shape)
    claim(bool(np.isfinite(value).all()), f"{what} is finite")
