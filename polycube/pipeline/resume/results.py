"""Store and load the results of each stage, so that a run can be resumed."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from polycube.errors import InputError, brief
from polycube.io import artifacts, manifest
from polycube.kinds import KINDS
from polycube.types import (
    Deformation,
    HexMesh,
    Labels,
    Modes,
    Parametrization,
    Potential,
    Ranked,
    Spline,
    TriMesh,
)

TYPES: dict[str, Any] = {  # of a field of the state that a stage gives
    "hexes": HexMesh,
    "labels": Labels,
    "parametrization": Parametrization,
    "spline": Spline,
    "solution": (Modes, Deformation, Potential),
}
SIZES: dict[type, Callable[[Any], dict[str, int]]] = {  # numbers that equal those of other results
    TriMesh: lambda part: {"triangles": len(part.faces), "corners": len(part.vertices)},
    Labels: lambda labels: {"triangles": len(labels.axis)},
    Parametrization: lambda own: {"corners": len(own.positions)},
    Spline: lambda own: {"functions": len(own.control), "Bezier nodes": own.extraction.shape[0]},
    Modes: lambda modes: {"functions": modes.shapes.shape[1]},
    Deformation: lambda own: {"Bezier nodes": len(own.stress)},
    Potential: lambda own: {"functions": len(own.values), "Bezier nodes": len(own.flux)},
}
REMEDY = "resume from an earlier stage"
PARTS = {"read": (TriMesh, str, list), "structure": (list, int), "given": (HexMesh, str)}


@dataclass
class StageResults:
    """The stored results of the stages of a run, some of them from an earlier run."""

    source: Path | None = None  # folder of the earlier run; None for a new run
    loaded: Collection[str] = ()  # names of the stages whose results are loaded from there
    change: Callable[[Any], Any] = lambda value: value  # applied to each loaded result
    folder: Path | None = None  # folder of this run; None: results are not stored
    _sizes: dict[str, int] = field(default_factory=dict)

    def is_loaded(self, kind: str) -> bool:
        """Whether the result of this stage is loaded from the earlier run."""
        return kind in self.loaded

    def load(self, kind: str) -> Any:
        """Load the result of a stage of the earlier run."""
        assert self.source is not None
        value = load_stage(self.source, kind)
        for one in value if isinstance(value, list) else [value]:
            self._check_together(kind, one)
        return self.change(value)

    def _check_together(self, kind: str, value: object) -> None:
        """Raise InputError if a result does not fit those that were loaded before."""
        for what, number in SIZES[type(value)](value).items() if type(value) in SIZES else ():
            if self._sizes.setdefault(what, number) != number:
                why = f"the stored result has {number} {what}, not {self._sizes[what]}"
                raise InputError(why, stage_name(kind), REMEDY)

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
        what = f"contains no result of stage {kind!r}"
        raise InputError(f"{folder} {what}; it contains {have or 'none'}")
    try:
        value = artifacts.load(path)
        if not _is_of(kind, value):
            raise ValueError(f"it is no result of stage {kind!r}")
        return value
    except Exception as error:  # zip, zlib, numpy and JSON raise different errors
        what = f"the stored result is damaged ({brief(error)})"
        raise InputError(what, str(path), REMEDY) from error


def _is_of(kind: str, value: Any) -> bool:
    """Whether a value can be the result of a stage."""
    if kind not in PARTS:
        return kind not in KINDS or isinstance(value, TYPES.get(KINDS[kind].gives, object))
    parts = PARTS[kind]
    if not isinstance(value, list | tuple) or len(value) < len(parts):
        return False
    if kind == "structure" and not (
        isinstance(value[1], int)
        and 0 <= value[1] < len(value[0])
        and all(isinstance(each, Ranked) for each in value[0])
    ):
        return False
    return all(isinstance(part, own) for part, own in zip(value, parts, strict=False))


def has_stage(folder: Path, kind: str) -> bool:
    """Whether there is a stored result of this kind."""
    return (folder / stage_name(kind)).is_file()


def stage_name(kind: str) -> str:
    """File name of a stage in a results folder."""
    return f"stages/{kind.replace('/', '.')}.npz"
