"""Store and load the results of each stage, so that a run can be resumed.

Each result is one .npz file: the arrays under the path of their field, and the rest as JSON,
without pickle. Integers are stored as differences of rows: meshes and sparse matrices change little
from row to row, so these compress to at most half the size. Other numbers are stored with all first
bytes together, then all second bytes etc., because signs and exponents compress; no bit is lost.
"""

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from polycube import types
from polycube.errors import InputError, brief
from polycube.io import manifest
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
LARGEST, RATIO = 1 << 26, 300  # bytes of a small file, and of each byte of its compressed form
PLAIN = (str, int, float, bool, type(None))  # types of JSON, which long sequences may contain


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
        """Load the result of a stage of the earlier run.

        Raises InputError if it does not fit those that were loaded before.
        """
        assert self.source is not None
        value = load_stage(self.source, kind)
        for one in value if isinstance(value, list) else [value]:
            for what, number in SIZES.get(type(one), lambda value: {})(one).items():
                if self._sizes.setdefault(what, number) != number:
                    why = f"the stored result has {number} {what}, not {self._sizes[what]}"
                    raise InputError(why, stage_name(kind), REMEDY)
        return self.change(value)

    def store(self, kind: str, value: object) -> None:
        """Store the result of a stage in the folder of this run, if it has one."""
        if self.folder is not None:
            save_stage(self.folder, kind, value)


def save_stage(folder: Path, kind: str, value: object) -> None:
    """Store the result of a stage as `folder/stages/<kind>.npz`."""
    with manifest.writing(folder) as scratch:
        (scratch / "stages").mkdir()
        save(scratch / stage_name(kind), value)


def load_stage(folder: Path, kind: str) -> Any:
    """Load a result stored by `save_stage`; raises InputError with the existing stages."""
    path = folder / stage_name(kind)
    if not path.is_file():
        have = ", ".join(sorted(p.stem.replace(".", "/") for p in path.parent.glob("*.npz")))
        what = f"contains no result of stage {kind!r}"
        raise InputError(f"{folder} {what}; it contains {have or 'none'}")
    try:
        value = load(path)
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
    if not all(isinstance(part, own) for part, own in zip(value, parts, strict=False)):
        return False
    if kind != "structure":
        return True
    ranked, chosen, *_ = value
    return 0 <= chosen < len(ranked) and all(isinstance(each, Ranked) for each in ranked)


def has_stage(folder: Path, kind: str) -> bool:
    """Whether there is a stored result of this kind."""
    return (folder / stage_name(kind)).is_file()


def stage_name(kind: str) -> str:
    """File name of a stage in a results folder."""
    return f"stages/{kind.replace('/', '.')}.npz"


def save(path: Path, value: object) -> None:
    """Write dataclasses, sequences, arrays, sparse matrices and plain values to one .npz file."""
    arrays: dict[str, np.ndarray] = {}
    tree = _pack(value, "value", arrays)
    np.savez_compressed(path, allow_pickle=False, tree=np.array(json.dumps(tree)), **arrays)


def load(path: Path) -> object:
    """Load a value written by `save`; raises FileNotFoundError if there is no such file."""
    with np.load(path, allow_pickle=False) as arrays:
        size = sum(each.file_size for each in arrays.zip.infolist())
        if size > LARGEST + RATIO * path.stat().st_size:
            raise ValueError(f"its {size} bytes are compressed to {path.stat().st_size}")
        return _unpack(json.loads(str(arrays["tree"])), arrays)


def _pack(value: object, name: str, arrays: dict[str, np.ndarray]) -> object:
    if isinstance(value, np.ndarray) and value.dtype.kind in "iu" and value.ndim:
        arrays[name] = np.diff(value, axis=0, prepend=np.zeros_like(value[:1]))
        return {"steps": name}
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        single = np.ascontiguousarray(value).reshape(-1, 1)
        arrays[name] = np.ascontiguousarray(single.view(np.uint8).T)
        return {"planes": name, "type": value.dtype.str, "shape": list(value.shape)}
    if isinstance(value, np.ndarray):
        arrays[name] = value
        return {"array": name}
    if isinstance(value, csr_matrix):
        parts = (value.data, value.indices, value.indptr)
        packed = [_pack(part, f"{name}.{i}", arrays) for i, part in enumerate(parts)]
        return {"csr": packed, "shape": list(value.shape)}
    if is_dataclass(value):
        names = [each.name for each in fields(value)]
        own = {n: _pack(getattr(value, n), f"{name}.{n}", arrays) for n in names}
        return {"class": type(value).__name__, "fields": own}
    if isinstance(value, list | tuple):
        items = list(value)
        if not all(type(item) in PLAIN for item in value):
            items = [_pack(item, f"{name}.{i}", arrays) for i, item in enumerate(value)]
        return {"tuple" if isinstance(value, tuple) else "list": items}
    if isinstance(value, dict):
        return {"dict": {k: _pack(v, f"{name}.{k}", arrays) for k, v in value.items()}}
    return value.item() if isinstance(value, np.generic) else value


def _unpack(tree: object, arrays: np.lib.npyio.NpzFile) -> object:
    if not isinstance(tree, dict):
        return tree
    if "steps" in tree:
        steps = arrays[tree["steps"]]
        return steps.cumsum(axis=0, dtype=steps.dtype)
    if "planes" in tree:
        if np.dtype(tree["type"]).kind != "f":
            raise ValueError("numbers of an unknown type")
        single = np.ascontiguousarray(arrays[tree["planes"]].T)
        return single.view(tree["type"]).reshape(tree["shape"])
    if "array" in tree:
        return arrays[tree["array"]]
    if "csr" in tree:
        parts = tuple(_unpack(part, arrays) for part in tree["csr"])
        matrix = csr_matrix(parts, shape=tree["shape"])
        matrix.check_format(full_check=True)
        return matrix
    if "class" in tree:
        name = tree["class"]
        cls: Any = getattr(types, name, None)
        if not (isinstance(cls, type) and is_dataclass(cls)):
            raise ValueError(f"artifact contains a {name}, which polycube.types does not define")
        value = cls(**{k: _unpack(v, arrays) for k, v in tree["fields"].items()})
        types.check_values(value)
        return value
    if "tuple" in tree:
        return tuple(_unpack(t, arrays) for t in tree["tuple"])
    if "list" in tree:
        return [_unpack(t, arrays) for t in tree["list"]]
    return {k: _unpack(v, arrays) for k, v in tree["dict"].items()}
