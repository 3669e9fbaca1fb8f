"""Store and load the results of each stage, so that a run can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from polycube.errors import InputError, brief
from polycube.io import artifacts, manifest


@dataclass
class StageResults:
    """The stored results of the stages of a run, some of them from an earlier run.

    Parameters
    ----------
    source : folder of the earlier run; None for a new run
    loaded : names of the stages whose results are loaded from there
    change : applied to each loaded result
    folder : folder of this run; None: results are not stored
    """

    source: Path | None = None
    loaded: Collection[str] = ()
    change: Callable[[Any], Any] = lambda value: value
    folder: Path | None = None

    def is_loaded(self, kind: str) -> bool:
        """Whether the result of this stage is loaded from the earlier run."""
        return kind in self.loaded

    def load(self, kind: str) -> Any:
        """Load the result of a stage of the earlier run."""
        assert self.source is not None
        return self.change(load_stage(self.source, kind))

    def store(self, kind: str, value: object) -> None:
        """Store the result of a stage in the folder of this run, if it has one."""
        if self.folder is not None:
            save_stage(self.folder, kind, value)


def save_stage(folder: Path, kind: str, value: object) -> None:
    """Store the result of a stage as `folder/stages/<kind>.npz`."""
    with manifest.writing(folder) as scratch:
        (scratch / "stages").mkdir()
        artifacts.save(scratch / stage_name(kind), value)


def load_stage(folder: Path, kind: str) -> Any:
    """Load a result stored by `save_stage`; raises InputError with the existing stages."""
    path = folder / stage_name(kind)
    if not path.is_file():
        have = ", ".join(sorted(p.stem.replace(".", "/") for p in path.parent.glob("*.npz")))
        raise InputError(
            f"{folder} contains no result of stage {kind!r}; it contains {have or 'none'}"
        )
    try:
        return artifacts.load(path)
    except Exception as error:  # zip, zlib, numpy and JSON raise different errors
        what = f"the stored result is damaged ({brief(error)})"
        raise InputError(what, str(path), "resume from an earlier stage") from error


def has_stage(folder: Path, kind: str) -> bool:
    """Whether there is a stored result of this kind."""
    return (folder / stage_name(kind)).is_file()


def stage_name(kind: str) -> str:
    """File name of a stage in a results folder."""
    return f"stages/{kind.replace('/', '.')}.npz"
