"""Read nodes and hexahedra of Abaqus and CalculiX files; meshio refuses many types of elements."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief

# solids; other elements are flat or connect nodes
SOLID = re.compile(r"(?:[A-Z]*C3D|COH3D|CIN3D|SC|CSS|CCL)(\d+)[A-Z]*")
HEXES = {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}


def read_abaqus(path: Path) -> dict[str, np.ndarray]:
    """Points and blocks of hexes, as `foreign.parsers.by_meshio`, and number of other solids.

    Raises
    ------
    InputError
        If the file is damaged, or has several parts with the same node numbers.
    """
    nodes: list[list[str]] = []
    blocks: list[tuple[str, int, list[str]]] = []
    kinds, numbers = [], []
    found: dict[str, np.ndarray] = {}
    try:
        for keyword, rows in _sections(path.read_text(encoding="latin-1")):
            name = keyword.partition(",")[0].strip("* ")
            if name == "NODE":
                nodes += [
                    [*(field.strip() or "0" for field in row.split(",")), *"000"][:4]
                    for row in rows
                ]
            elif name == "ELEMENT":
                named = re.search(r"TYPE\s*=\s*(\w+)", keyword)
                solid = SOLID.fullmatch(named[1]) if named else None
                if solid:
                    blocks.append((solid[0], int(solid[1]), rows))
        table = np.array(nodes, np.float64).reshape(-1, 4)
        number, first, place = np.unique(table[:, 0], return_index=True, return_inverse=True)
        if (table[first][place] != table).any():
            raise InputError("a node has two places; give a file of one part")
        for i, (kind, size, rows) in enumerate(blocks):
            fields = [field for row in rows for field in row.split(",") if field.strip()]
            own = np.array(fields, np.int64).reshape(-1, size + 1)[:, 1:]
            kinds.append(HEXES.get(size, kind) if "C3D" in kind else kind)
            numbers.append(len(own))
            if kinds[-1] in HEXES.values():
                at = np.searchsorted(number, own[:, :8])
                if (np.take(number, at, mode="clip") != own[:, :8]).any():
                    raise InputError("an element refers to a node that does not exist")
                found[f"hexes {i}"] = first[at]
    except (ValueError, LookupError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"not a readable {path.suffix} file: {brief(error)}") from None
    return {
        "points": table[:, 1:],
        "kind": np.array(kinds, str),
        "number": np.array(numbers),
        **found,
    }


def _sections(text: str) -> list[tuple[str, list[str]]]:
    """Each keyword in capital letters with its parameters, and the lines of data after it."""
    found: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            found.append((line.upper(), []))
        elif found and found[-1][0].endswith(",") and not found[-1][1]:
            found[-1] = (found[-1][0] + line.upper(), [])  # a keyword may take several lines
        elif found:
            found[-1][1].append(line)
    return found
