"""Save and load the results of stages, so that a run can be resumed.

Each value is one .npz file: the arrays under the path of their field, and the rest as JSON, without
pickle. Integers are stored as differences of rows: meshes and sparse matrices change little from
row to row, so these compress to at most half the size. Other numbers are stored with all first
bytes together, then all second bytes etc., because signs and exponents compress; no bit is lost.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from polycube import types

LARGEST, RATIO = 1 << 26, 300  # bytes of a small file, and of each byte of its compressed form
PLAIN = (str, int, float, bool, type(None))  # types of JSON, which long sequences may contain


def save(path: Path, value: object) -> None:
    """Write dataclasses, sequences, arrays, sparse matrices and plain values to one .npz file."""
    arrays: dict[str, np.ndarray] = {}
    tree = _pack(value, "value", arrays)
    np.savez_compressed(path, allow_pickle=False, tree=np.array(json.dumps(tree)), **arrays)


def load(path: Path) -> object:
    """Load a value written by `save`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError, KeyError, TypeError, zipfile.BadZipFile
        If it is damaged, or if values of a class are not in their range (`types.check_values`).
    """
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
    if dataclasses.is_dataclass(value):
        names = [each.name for each in dataclasses.fields(value)]
        fields = {n: _pack(getattr(value, n), f"{name}.{n}", arrays) for n in names}
        return {"class": type(value).__name__, "fields": fields}
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
        if not (isinstance(cls, type) and dataclasses.is_dataclass(cls)):
            raise ValueError(f"artifact contains a {name}, which polycube.types does not define")
        value = cls(**{k: _unpack(v, arrays) for k, v in tree["fields"].items()})
        types.check_values(value)
        return value
    if "tuple" in tree:
        return tuple(_unpack(t, arrays) for t in tree["tuple"])
    if "list" in tree:
        return [_unpack(t, arrays) for t in tree["list"]]
    return {k: _unpack(v, arrays) for k, v in tree["dict"].items()}
