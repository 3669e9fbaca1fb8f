"""Settings of a whole run, that are no plugin's: refused before anything is done."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from polycube.errors import InputError

HALVES = ("meshing", "spline", "analysis")  # of a run; each needs the one before it


def check_settings(cfg: Mapping[str, object]) -> None:
    """Raise InputError for a run-wide setting that makes no sense."""
    order = cfg["order"]
    chain = [name for name in order if name != "report"] if isinstance(order, list) else ["?"]
    if chain != list(HALVES[: len(chain)]):
        raise InputError(
            f"order is a list that begins as [{', '.join(HALVES)}] does, with report where the "
            f"page is wanted; got {order}"
        )
    for name, least in {"tries": 1, "seed": 0}.items():
        value = cfg[name]
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InputError(f"{name} must be a whole number, {least} or more; got {value!r}")
    for name in ("quiet", "verbose"):
        if not isinstance(cfg[name], bool):
            raise InputError(f"{name} must be true or false; got {cfg[name]!r}")
    least = cfg["least_jacobian"]
    if isinstance(least, bool) or not isinstance(least, int | float) or not 0 <= least <= 1:
        raise InputError(f"least_jacobian must be a number from 0 to 1; got {least!r}")
    seconds = cfg["seconds"]
    is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if seconds is not None and not (is_number and 0 < seconds < math.inf):
        raise InputError(f"seconds must be null or a positive number; got {seconds!r}")


def unlike(
    cfg: Mapping[str, object], kept: Mapping[str, object], kinds: Iterable[str]
) -> list[str]:
    """Settings of these kinds of stages that are not those of the kept run, in words."""
    groups = dict.fromkeys(kind.partition("/")[0] for kind in kinds)
    now = {name: value for group in groups for name, value in _flat(cfg.get(group), group)}
    before = {name: value for group in groups for name, value in _flat(kept.get(group), group)}
    return [
        f"{name} is {now.get(name)}, was {before.get(name)}"
        for name in {**now, **before}
        if now.get(name) != before.get(name)
    ]


def _flat(value: object, name: str) -> Iterator[tuple[str, object]]:
    """Full names and values of what a setting holds."""
    if not isinstance(value, Mapping):
        yield name, value
        return
    for key, held in value.items():
        yield from _flat(held, f"{name}.{key}")
