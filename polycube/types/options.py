"""Options: the type of a field of a dataclass says which values it admits.

`Literal["a", "b"]` is a choice, `Annotated[int, limits(1)]` a number with limits, `X | None` has
null as another value. `Mapping` and `Sequence` admit any content, other types every value; also
`float | str`, whose words the class knows.
"""

import inspect
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from math import inf
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Union, get_args, get_origin

from polycube.errors import InputError


class Such(NamedTuple):
    """A condition on a value, and what it requires."""

    holds: Callable[[Any], bool]
    text: str


def is_number(value: object) -> bool:
    """Whether the value is a number and not a boolean."""
    return isinstance(value, Real) and not isinstance(value, bool)


PLAIN: dict[Any, Such] = {
    bool: Such(lambda value: isinstance(value, bool), "true or false"),
    int: Such(lambda value: isinstance(value, Integral) and is_number(value), "a whole number"),
    float: Such(is_number, "a number"),
    str: Such(lambda value: isinstance(value, str), "a word"),
    NoneType: Such(lambda value: value is None, "null"),
    Mapping: Such(lambda value: isinstance(value, Mapping), "a group of settings"),
    Sequence: Such(
        lambda value: isinstance(value, Iterable) and not isinstance(value, str | Mapping), "a list"
    ),
}


def limits(least: float, most: float = inf, is_open: bool = False) -> Such:
    """The condition on a number to be from `least` to `most`, or between them if it is open."""
    if is_open:
        text = f"above {least:g}" + f" and below {most:g}" * (most < inf)
        return Such(lambda value: least < value < most, text)
    text = f"{least:g} or more" if most == inf else f"{least:g} to {most:g}"
    return Such(lambda value: least <= value <= most, text)


Positive = Annotated[float, limits(0, is_open=True)]
Share = Annotated[float, limits(0, 1)]
Count = Annotated[int, limits(1)]


def condition(kind: Any) -> Such:
    """The condition that a type sets on values; a boolean is not a number."""
    origin, args = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType) and not {float, str} <= {*args}:
        parts = [condition(each) for each in sorted(args, key=lambda each: each is not NoneType)]
        text = " or ".join(part.text for part in parts)
        return Such(lambda value: any(part.holds(value) for part in parts), text)
    if origin is Annotated:
        parts = [condition(args[0]), *args[1:]]
        text = ", ".join(part.text for part in parts[args[0] not in PLAIN :])
        return Such(lambda value: all(part.holds(value) for part in parts), text)
    if origin is Literal:
        words = [*map(str, args)]
        text = "one of " * (len(words) > 1) + ", ".join(words)
        return Such(lambda value: not isinstance(value, bool) and str(value) in words, text)
    return PLAIN.get(origin or kind, Such(lambda value: True, ""))


def require(name: str, such: Such, value: object) -> None:
    """Raise InputError unless a condition on the value of an option holds."""
    if not such.holds(value):
        raise InputError(f"{name} must be {such.text}; got {value!r}")


@cache
def kinds(cls: type) -> Mapping[str, Any]:
    """The types of the fields of a class, except for those that only type checkers know."""
    found = {}
    for base in reversed(cls.__mro__):
        known = vars(sys.modules[base.__module__])
        for name, kind in inspect.get_annotations(base).items():
            with suppress(NameError):
                found[name] = eval(kind, known) if isinstance(kind, str) else kind
    return found


def check_options(cls: type, values: Mapping[str, object], group: str = "") -> None:
    """Raise InputError for the first value that the type of its field does not admit."""
    for name, kind in kinds(cls).items():
        if name in values:
            require(group + name, condition(kind), values[name])


class Options:
    """Base of a dataclass whose values are checked when it is made."""

    group: ClassVar[str] = ""  # where its options are, such as "cad."

    def __post_init__(self) -> None:
        check_options(type(self), vars(self), self.group)
