"""The settings of a resumed run: stages that do not run again have those of the earlier run."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields
from itertools import takewhile
from pathlib import Path
from typing import Any

from polycube.config import by_name, compose
from polycube.errors import InputError
from polycube.io.access.reading import read_json
from polycube.pipeline.settings import Settings
from polycube.registry import classes
from polycube.types import Json

STAGES = {  # stages in order, with the settings that no later stage uses
    "read": "mesh hex cad points repair".split(),
    "structure": "grid primitives structure context ckpt context_structure ranking".split(),
    "meshing": "meshing improve effort seconds seed".split(),
    "spline": ["spline"],
    "analysis": [],
}
FILES = ("mesh", "hex")
REMEDY = "run the part again without resume="


def with_earlier_settings(settings: Settings) -> Settings:
    """The settings, with those of stages whose results are loaded taken from the earlier run.

    Raises InputError if the user set one of these to another value, which would have no effect.
    """
    start, first = str(settings.start), str(settings.start).partition("/")[0]
    earlier = stored(settings.resume) if settings.resume else {}
    if not earlier or first not in STAGES:
        return settings  # `Run` refuses an unknown stage and a folder without results
    now, loaded = settings.composed, takewhile(lambda stage: stage != first, STAGES)
    groups = [group for stage in loaded for group in STAGES[stage] if group in earlier]
    new, old = _options(now), _options(earlier)
    for name in _changed(new, old):
        if name.partition(".")[0] in groups or _is_before(start, name, now["meshing"]):
            used = "because the result of the resumed run is used"
            what = f"{new[name]} has no effect, {used}, which was made with {old[name]}"
            raise InputError(what, name, "leave it out, or start at an earlier stage with from=")
    return Settings.of({**now, **{group: earlier[group] for group in groups}})


def _options(settings: Json) -> dict[str, Any]:
    """Values of all options by their full names, files as absolute paths."""
    found = {name: value for name, value in by_name(settings) if not isinstance(value, Mapping)}
    return found | {name: str(Path(found[name]).resolve()) for name in FILES if found.get(name)}


def _changed(now: Json, earlier: Json) -> Iterator[str]:
    """Options whose value is neither that of the earlier run nor the default, outer ones first.

    Options of plugins that follow from a setting of the run, such as `seed` or `meshing.size`, are
    left out; that setting itself is in the list.
    """
    every = (option for cls in classes().values() for option in fields(cls))
    source = {o.name: o.metadata["setting"] for o in every if "setting" in o.metadata}
    default = _options(compose("infer"))
    for name in sorted(now.keys() & earlier.keys(), key=lambda name: (name.count("."), name)):
        setting = source.get(name.rpartition(".")[2], name)
        is_derived = setting != name and now[name] == now.get(setting)
        if not is_derived and now[name] not in (earlier[name], default.get(name)):
            yield name


def _is_before(start: str, name: str, meshing: Json) -> bool:
    """Whether an option is used only by meshing stages before `start`."""
    if start not in meshing["order"] or not name.startswith("meshing."):
        return False
    own = name.split(".")[1]  # the stage of the option, or an option that stages may share
    place = meshing["order"].index(start)
    stages = [stage.partition("/")[2] for stage in meshing["order"]]
    uses = [own in (stage, *meshing[stage]) for stage in stages]
    return any(uses[:place]) and not any(uses[place:])


def stored(folder: Path) -> Json:
    """The settings of an earlier run; empty if its folder has none."""
    path = folder / "config.json"
    return read_json(path, REMEDY) if path.is_file() else {}


def changed_settings(now: Json, before: Json, kinds: Iterable[str]) -> list[str]:
    """List the settings of these kinds that differ from those of the resumed run."""
    groups = dict.fromkeys(kind.partition("/")[0] for kind in kinds)
    new, old = (_options({group: each.get(group) for group in groups}) for each in (now, before))
    changed = (name for name in {**new, **old} if new.get(name) != old.get(name))
    return [f"{name} is {new.get(name)}, was {old.get(name)}" for name in changed]
