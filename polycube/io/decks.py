"""Read nodes and hexahedra of Abaqus, CalculiX and Nastran files.

meshio refuses many types of elements of Abaqus, and does not end without ENDDATA in Nastran files.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief

# type of the solids of Abaqus, and its number of nodes; other elements are flat or connect nodes
SOLID = re.compile(r"TYPE\s*=\s*((?:[A-Z]*C3D|COH3D|CIN3D|SC|CSS|CCL)(\d+)[A-Z]*)(?!\w)")
HEXES = {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}
OTHERS = ("CTETRA", "CPENTA", "CPYRAM", "CPYRA")  # other solids of Nastran
SIGN = re.compile(r"(?<=[\d.])[DE]?([-+]\d)", re.IGNORECASE)  # exponents as in 1.5-3

Arrays = dict[str, np.ndarray]
Blocks = Sequence[tuple[str, np.ndarray]]  # kind of cells, and numbers of their nodes


def read_deck(path: Path) -> Arrays:
    """Points and blocks of hexes, as `foreign.parsers.by_meshio`, and number of other solids.

    Raises InputError if the file is damaged, or has several parts with the same node numbers.
    """
    text = path.read_text(encoding="latin-1")
    try:
        nodes, blocks = (_abaqus if path.suffix.lower() == ".inp" else _nastran)(text)
        return _found(np.array(nodes, np.float64).reshape(-1, 4), blocks)
    except (ValueError, LookupError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"not a readable {path.suffix} file: {brief(error)}") from None


def _found(nodes: np.ndarray, blocks: Blocks) -> Arrays:
    number, first, place = np.unique(nodes[:, 0], return_index=True, return_inverse=True)
    if (nodes[first][place] != nodes).any():
        raise InputError("a node has two places; give a file of one part")
    found = {"points": nodes[:, 1:], "kind": np.array([kind for kind, _ in blocks], str)}
    found["number"] = np.array([len(own) for _, own in blocks])
    for i, (kind, own) in enumerate(blocks):
        if kind in HEXES.values():
            at = np.searchsorted(number, own[:, :8])
            if (np.take(number, at, mode="clip") != own[:, :8]).any():
                raise InputError("an element refers to a node that does not exist")
            found[f"hexes {i}"] = first[at]
    return found


def _abaqus(text: str) -> tuple[list[list[str]], Blocks]:
    """Rows of number and place of the nodes, and blocks of solids."""
    nodes: list[list[str]] = []
    blocks: list[tuple[str, np.ndarray]] = []
    for keyword, rows in _sections(text):
        name = keyword.partition(",")[0].strip("* ")
        if name == "NODE":
            split = ([field.strip() or "0" for field in row.split(",")] for row in rows)
            nodes += [[*fields, "0", "0", "0"][:4] for fields in split]
        elif name == "ELEMENT" and (solid := SOLID.search(keyword)):
            kind, size = solid[1], int(solid[2])
            fields = [field for row in rows for field in row.split(",") if field.strip()]
            kind = HEXES.get(size, kind) if "C3D" in kind else kind
            blocks.append((kind, np.array(fields, np.int64).reshape(-1, size + 1)[:, 1:]))
    return nodes, blocks


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


def _nastran(text: str) -> tuple[list[list[str]], Blocks]:
    """Like `_abaqus`."""
    nodes: list[list[str]] = []
    blocks: dict[str, list[list[str]]] = {}
    for name, fields in _cards(text):
        if name == "GRID":
            number, system, *place = [*fields, *"     "][:5]
            if system.strip() not in ("", "0"):
                raise InputError(f"node {number} is in another system of coordinates ({system})")
            nodes.append([number, *(SIGN.sub(r"E\1", each.strip() or "0") for each in place)])
        elif name == "CHEXA":
            corners = [field for field in fields[2:] if field.strip()]
            kind = HEXES[8] if len(corners) == 8 else HEXES[20]  # some of its nodes may be missing
            blocks.setdefault(kind, []).append(fields[2:10])
        elif name in OTHERS:
            blocks.setdefault(name, []).append(["0"])
    return nodes, [(kind, np.array(rows, np.int64)) for kind, rows in blocks.items()]


def _cards(text: str) -> Iterator[tuple[str, list[str]]]:
    """Name and fields of each card; the fields are 8 or 16 characters wide, or end with commas."""
    _, begin, bulk = text.upper().partition("BEGIN BULK")
    name, fields = "", []
    for line in [*(bulk if begin else text.upper()).splitlines(), "ENDDATA"]:
        line = line.partition("$")[0].expandtabs(8).rstrip()
        first, *free = line.split(",") if "," in line else (line[:8],)
        first, is_wide = first.strip(), "*" in first
        if not line:
            continue
        width = 16 if is_wide else 8
        own = free or [line[i : min(i + width, 72)] for i in range(8, min(len(line), 72), width)]
        own = (own + 8 * [""])[: 64 // width]
        if first.startswith(("+", "*")) or not first:
            fields += own
            continue
        if name:
            yield name, fields
        name, fields = first.rstrip("*"), own
        if name == "ENDDATA":
            return
