"""Keep what each stage made, so that a run can start again in the middle."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from polycube.errors import InputError, brief
from polycube.io import artifacts, manifest


def save_stage(folder: Path, kind: str, value: object) -> None:
    """Keep what a stage made as `folder/stages/<kind>.npz`."""
    with manifest.writing(folder) as scratch:
        (scratch / "stages").mkdir()
        artifacts.save(scratch / stage_name(kind), value)


def load_stage(folder: Path, kind: str) -> Any:
    """Load what `save_stage` kept; raises InputError, naming the stages that are there."""
    path = folder / stage_name(kind)
    if not path.is_file():
        have = ", ".join(sorted(p.stem.replace(".", "/") for p in path.parent.glob("*.npz")))
        raise InputError(
            f"{folder} contains no result of stage {kind!r}; it contains {have or 'none'}"
        )
    try:
        return artifacts.load(path)
    except Exception as error:  # zip, zlib, numpy and JSON each have exceptions of their own
        what = f"the kept result is damaged ({brief(error)})"
        raise InputError(what, str(path), "resume from an earlier stage") from error


def has_stage(folder: Path, kind: str) -> bool:
    """Whether `save_stage` kept something of this kind."""
    return (folder / stage_name(kind)).is_file()


def changed_settings(
    now: Mapping[str, object], before: Mapping[str, object], kinds: Iterable[str]
) -> list[str]:
    """List the settings of these kinds that differ from those of the run that is resumed."""
    groups = dict.fromkeys(kind.partition("/")[0] for kind in kinds)
    new = {name: value for group in groups for name, value in _flat(now.get(group), group)}
    old = {name: value for group in groups for name, value in _flat(before.get(group), group)}
    return [
        f"{name} is {new.get(name)}, was {old.get(name)}"
        for name in {**new, **old}
        if new.get(name) != old.get(name)
    ]


def _flat(value: object, name: str) -> Iterator[tuple[str, object]]:
    """Full names and values of what a setting holds."""
    if not isinstance(value, Mapping):
        yield name, value
        return
    for key, held in value.items():
        yield from _flat(held, f"{name}.{key}")


def stage_name(kind: str) -> str:
    """The file of a stage in a results folder."""
    return f"stages/{kind.replace('/', '.')}.npz"
