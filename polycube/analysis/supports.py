"""Supports of a displacement from options: lists of places and the values prescribed there.

An item is only a place (x_min, 7, {box: [...]}, {plane: [...]}, {edge: [x_min, z_min]}, see
`polycube.analysis.boundary_sets`) or {at: place, ...} with the prescribed values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from polycube.analysis.problem import Prescribed
from polycube.types import Json, Spline
from polycube.types.checks import is_number

if TYPE_CHECKING:
    from polycube.analysis.constraints import Support

AXES = "xyz"


def supports(spline: Spline, given: Sequence[Prescribed]) -> list[Support]:
    """The supports of a spline; raises InputError for a place that does not exist."""
    from polycube.analysis.boundary_sets import edges_of, faces_of, is_edge, place_name
    from polycube.analysis.constraints import Support

    def support(each: Prescribed) -> Support:
        own = place_name(each.place)
        if is_edge(each.place):
            none, edges = np.zeros(0, np.int64), edges_of(spline, each.place)
            return Support(own, none, each.components, each.values, edges)
        return Support(own, faces_of(spline, each.place), each.components, each.values)

    return [support(each) for each in given]


def prescribed(items: Sequence[object]) -> tuple[Prescribed, ...]:
    """The supports of a displacement for the description of a problem."""
    found = []
    for place, settings in map(split, items):
        axes = tuple(AXES.index(axis) for axis in settings.get("components", AXES))
        value = settings.get("value", 0.0)
        values = len(axes) * (value,) if is_number(value) else tuple(value)
        found.append(Prescribed(place, axes, tuple(map(float, values))))
    return tuple(found)


def split(item: object) -> tuple[object, Json]:
    """Place of an item, and the values prescribed there."""
    if isinstance(item, Mapping) and "at" in item:
        return item["at"], {key: value for key, value in item.items() if key != "at"}
    return item, {}
