"""The settings of a resumed run: stages that do not run again have those of the earlier run."""

import logging
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from polycube.config import compose
from polycube.errors import InputError
from polycube.io.access.stored import read_json
from polycube.pipeline.settings import Node, Settings
from polycube.registry import classes, options

logger = logging.getLogger(__name__)

STAGES = {  # stages in order, with the settings that no later stage uses
    "read": "mesh hex cad points repair".split(),
    "structure": "grid primitives structure context ckpt context_structure ranking".split(),
    "meshing": "meshing improve effort seconds seed".split(),
    "spline": ["spline"],
    "analysis": [],
}
ADVICE = "meshing.otherwise"  # a text that is printed only


def with_earlier_settings(settings: Settings) -> Settings:
    """The settings, with those of stages whose results are loaded taken from the earlier run.

    Raises
    ------
    InputError
        If the user set one of these to another value, which would have no effect.
    """
    start = str(settings.start)
    path = settings.resume and settings.resume / "config.json"
    if path is None or start.partition("/")[0] not in STAGES or not path.is_file():
        return settings  # `Run` refuses an unknown stage and a folder without results
    now, earlier = settings.composed, _read(path)
    names = list(STAGES)
    loaded = names[: names.index(start.partition("/")[0])]
    groups = [group for stage in loaded for group in STAGES[stage] if group in earlier]
    changed = _changed(now, earlier)
    without_effect = [name for name in changed if name.partition(".")[0] in groups]
    if start in now["meshing"]["order"]:
        without_effect += [name for name in changed if _is_before(start, name, now["meshing"])]
    for name in without_effect[:1]:
        raise InputError(
            f"{_value(now, name)} has no effect, because the result of the resumed run is used, "
            f"which was made with {_value(earlier, name)}",
            name,
            "leave it out, or start at an earlier stage with from=",
        )
    return Settings.of({**now, **{group: earlier[group] for group in groups}})


def _read(path: Path) -> Node:
    return read_json(path, "run the part again without resume=")


def _changed(now: Node, earlier: Node) -> list[str]:
    """Settings whose value is neither that of the earlier run nor the default, outer ones first.

    Settings of plugins that follow from a setting of the run, such as `seed` or `meshing.size`, are
    left out; that setting itself is in the list.
    """
    source = {
        option.name: option.metadata["setting"]
        for (kind, _), cls in classes().items()
        for option in options(kind, cls).values()
        if "setting" in option.metadata
    }
    before, default = _by_name(earlier), _defaults()
    found = []
    for name, value in _by_name(now).items():
        setting = source.get(name.rpartition(".")[2], name)
        is_derived = setting != name and value == _value(now, setting)
        if is_derived or name not in before or name == ADVICE:
            continue
        if name in ("mesh", "hex") and _is_same_file(value, before[name]):
            continue
        if value not in (before[name], default.get(name)):
            found.append(name)
    return sorted(found, key=lambda name: name.count("."))


@cache
def _defaults() -> dict[str, Any]:
    return _by_name(compose("infer"))


def _by_name(settings: Node) -> dict[str, Any]:
    """Values by their full names."""
    return {name: value for group in settings for name, value in _flat(settings[group], group)}


def _is_same_file(path: object, other: object) -> bool:
    return bool(path and other) and Path(str(path)).resolve() == Path(str(other)).resolve()


def _is_before(start: str, name: str, meshing: Node) -> bool:
    """Whether a setting is used only by meshing stages before `start`."""
    place = meshing["order"].index(start)
    stages = [stage.partition("/")[2] for stage in meshing["order"]]
    later = {option for stage in stages[place:] for option in meshing[stage]}
    group, _, option = name.removeprefix("meshing.").partition(".")
    if not name.startswith("meshing."):
        return False
    if option:
        return group in stages[:place]
    return group not in later and any(group in meshing[stage] for stage in stages[:place])


def _value(settings: Any, name: str) -> Any:
    for key in name.split("."):
        settings = settings.get(key) if isinstance(settings, Mapping) else None
    return settings


def warn_of_changed_settings(
    resumed: Path, now: Mapping[str, object], kinds: Iterable[str]
) -> None:
    """Log the settings of the remaining stages that differ from those of the resumed run."""
    path = resumed / "config.json"
    if path.is_file():
        for sentence in changed_settings(now, _read(path), kinds):
            logger.warning("warning: resumed with other settings: %s", sentence)


def changed_settings(
    now: Mapping[str, object], before: Mapping[str, object], kinds: Iterable[str]
) -> list[str]:
    """List the settings of these kinds that differ from those of the resumed run."""
    groups = dict.fromkeys(kind.partition("/")[0] for kind in kinds)
    new, old = (_by_name({group: each.get(group) for group in groups}) for each in (now, before))
    return [
        f"{name} is {new.get(name)}, was {old.get(name)}"
        for name in {**new, **old}
        if new.get(name) != old.get(name)
    ]


def _flat(value: object, name: str) -> Iterator[tuple[str, object]]:
    """Full names and values in a setting."""
    if not isinstance(value, Mapping):
        yield name, value
        return
    for key, item in value.items():
        yield from _flat(item, f"{name}.{key}")
