"""Checks of array shapes and types in the constructors of the data types."""

from collections.abc import Mapping
from dataclasses import fields
from numbers import Integral
from typing import Any, TypeVar, get_args

import numpy as np

from polycube.types.options import condition, kinds, require
from polycube.types.options import is_number as is_number

Json = Mapping[str, Any]  # a document, as in JSON and YAML: its values are of every kind
Bound = int | str | tuple[int | str, ...]  # a number, a field with that many rows; of each column
DTYPES = {"int": np.int64, "bool": np.bool_, "float32": np.float32}
PLAIN: dict[str, type | tuple[type, ...]] = {"int": int, "float": (int, float), "str": str}
PLAIN |= {"Mapping[str, str]": Mapping, "tuple[str, ...]": tuple}
Kind = TypeVar("Kind")


def is_whole(value: object, least: int) -> bool:
    """Whether the value is a whole number that is not too small, and not a boolean."""
    return isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= least


def options_of(name: str, kind: type[Kind], given: Mapping | Kind) -> Kind:
    """A dataclass of options from their values by name; raises ValueError for unknown names."""
    if isinstance(given, kind):
        return given
    require(name, condition(Mapping), given)
    known = [each.name for each in fields(kind)]  # type: ignore[arg-type]
    if unknown := sorted(set(given) - set(known)):  # type: ignore[arg-type]
        raise ValueError(f"{name} takes {', '.join(known)}; got {unknown[0]!r}")
    return kind(**given)  # type: ignore[arg-type]


class Arrays:
    """Base of a dataclass whose array fields are checked, copied and made read-only.

    Their types state the dimensions, then the type of the numbers unless it is float:
    `Annotated[np.ndarray, "F 3 int"]`. Equal letters mean equal lengths; "F?" is F or no rows.
    """

    def __post_init__(self) -> None:
        cls: Any = type(self)
        types = ((name, get_args(kind)) for name, kind in kinds(cls).items())
        freeze(self, **{name: args[1] for name, args in types if np.ndarray in args[:1]})


def freeze(obj: object, **specs: str) -> None:
    """Check array fields and make them read-only; raises ValueError for another shape."""
    sizes: dict[str, int] = {}
    for name, spec in specs.items():
        letters = [part for part in spec.split() if part not in DTYPES]
        dtype = DTYPES.get(spec.split()[-1], np.float64)
        array: np.ndarray = np.array(getattr(obj, name), dtype=dtype)  # own copy
        if letters[0].endswith("?"):
            letters[0] = letters[0][:-1] if array.size else "0"
        wanted = f"{type(obj).__name__}.{name} must have shape ({', '.join(letters)})"
        if array.ndim != len(letters):
            raise ValueError(f"{wanted}; got {array.shape}")
        for letter, size in zip(letters, array.shape, strict=True):
            if sizes.setdefault(letter, int(letter) if letter.isdigit() else size) != size:
                same = "" if letter.isdigit() else f" with {letter}={sizes[letter]}"
                raise ValueError(f"{wanted}{same}; got {array.shape}")
        array.flags.writeable = False
        object.__setattr__(obj, name, array)


def check_values(obj: Any) -> None:
    """Check the values of a dataclass that was read from a file.

    Its class may have `bounds`: the number of different values of an array of numbers from 0, or
    the name of the field with that many rows; for several columns, one for each. Raises ValueError
    for numbers that are not finite or out of range, and for values of another type.
    """
    bounds: Mapping[str, Bound] = getattr(obj, "bounds", {})
    for each in fields(obj):
        name, value = f"{type(obj).__name__}.{each.name}", getattr(obj, each.name)
        kind = PLAIN.get(str(each.type), object)
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise ValueError(f"{name} must be of the type {each.type}; got {value!r:.40}")
        for key, array in (value if isinstance(value, Mapping) else {"": value}).items():
            _check_array(f"{name}[{key!r}]" if key else name, array, obj, bounds.get(each.name))


def _check_array(name: str, array: Any, obj: Any, bound: Bound | None) -> None:
    if bound is not None and isinstance(array, tuple):
        array = np.array(array)
    if bound is not None and not isinstance(array, np.ndarray):
        raise ValueError(f"{name} must be an array")
    array = getattr(array, "data", array) if hasattr(array, "indptr") else array  # sparse
    if not isinstance(array, np.ndarray) or not array.size:
        return
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name} has values that are not finite")
    if bound is None:
        return
    each = bound if isinstance(bound, tuple) else (bound,)
    sizes = [getattr(obj, one).shape[0] if isinstance(one, str) else one for one in each]
    if array.ndim < len(each):
        raise ValueError(f"{name} must have rows of {len(each)} numbers")
    if array.dtype.kind not in "iu" or (array < 0).any() or (array >= sizes).any():
        raise ValueError(f"{name} must have numbers from 0 to {max(sizes) - 1}")
