"""Boundary conditions as options: lists of places and the values prescribed there.

An item is only a place (x_min, 7, {box: [...]}, {plane: [...]}, see
`polycube.analysis.boundary_sets`) or {at: place, ...} with the prescribed values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING

from polycube.types import Json, Spline

if TYPE_CHECKING:
    from polycube.analysis.constraints import Support
    from polycube.analysis.problem import Prescribed, Problem

AXES = "xyz"


def check_items(
    name: str, items: object, keys: set[str], needed: int = 0
) -> list[tuple[object, Json]]:
    """Place of each item and the values prescribed there.

    Raises ValueError unless every item has a place and at least `needed` of the keys.
    """
    from polycube.analysis.boundary_sets import check_place

    if isinstance(items, str | Mapping) or not isinstance(items, Sequence):
        raise ValueError(f"{name} must be a list such as [x_min]; got {items!r}")
    for item in items:
        place, settings = split(item)
        check_place(place)
        if not set(settings) <= keys or len(settings) < needed:
            raise ValueError(
                f"entries of {name} are {{at: place, {', '.join(sorted(keys))}}}; got {item!r}"
            )
    return list(map(split, items))


def check_supports(name: str, items: object, keys: set[str]) -> None:
    """Raise ValueError unless the items are supports of a displacement."""
    for _, settings in check_items(name, items, keys):
        components = settings.get("components", AXES)
        if not components or not set(components) <= set(AXES):
            raise ValueError(f"{name}: components must be some of x, y, z; got {components!r}")
        value = settings.get("value", 0.0)
        if not is_number(value):
            check_vector(f"{name}: value", value, len(components))


def check_vector(name: str, value: object, length: int = 3) -> None:
    """Raise ValueError unless the value is a list of `length` numbers."""
    numbers = value if isinstance(value, Sequence) and not isinstance(value, str) else ()
    if len(numbers) != length or not all(map(is_number, numbers)):
        raise ValueError(f"{name} must be {length} numbers; got {value!r}")


def is_number(value: object) -> bool:
    """Whether the value is a number and not a boolean."""
    return isinstance(value, Real) and not isinstance(value, bool)


def supports(spline: Spline, problem: Problem) -> list[Support]:
    """The supports of a problem; raises InputError for a place that does not exist."""
    from polycube.analysis.boundary_sets import faces_of, place_name
    from polycube.analysis.constraints import Support

    return [
        Support(place_name(each.place), faces_of(spline, each.place), each.components, each.values)
        for each in problem.supports
    ]


def prescribed(items: Sequence[object]) -> tuple[Prescribed, ...]:
    """The supports of a displacement for the description of a problem."""
    from polycube.analysis.problem import Prescribed

    found = []
    for place, settings in map(split, items):
        axes = tuple(AXES.index(axis) for axis in settings.get("components", AXES))
        value = settings.get("value", 0.0)
        values = len(axes) * (value,) if is_number(value) else tuple(value)
        found.append(Prescribed(place, axes, tuple(map(float, values))))
    return tuple(found)


def split(item: object) -> tuple[object, Json]:
    """Place of an item, and the values prescribed there."""
    from polycube.analysis.boundary_sets import place_of

    place = place_of(item)
    if not isinstance(item, Mapping) or place is item:
        return item, {}
    return place, {key: value for key, value in item.items() if key != "at"}
