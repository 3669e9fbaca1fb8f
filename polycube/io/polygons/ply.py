"""Read PLY files, text and binary: columns of the vertices, and polygons.

trimesh divides concave polygons at a wrong corner, and refuses comments before the format.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief
from polycube.io.polygons.division import Soup, triangulated

HEADER = 100_000  # largest size of the header, in bytes
KINDS = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"}
KINDS |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
KINDS |= {"float": "f", "double": "d", "float32": "f", "float64": "d"}  # codes of struct
TEXT = "text"
ORDER = {"ascii": TEXT, "binary_little_endian": "<", "binary_big_endian": ">"}
CORNERS = ("vertex_indices", "vertex_index")
LARGEST = 2**31  # of vertex numbers
WIDEST = 16  # rows with more numbers are not read as a table


@dataclass(frozen=True)
class Element:
    """A kind of elements, their number, and the name and the types of each property.

    A property has one type, or those of the length and of the items of a list.
    """

    name: str
    number: int
    properties: list[tuple[str, list[str]]] = field(default_factory=list)


def is_points(path: Path) -> bool:
    """Whether the header has vertices, but no faces."""
    try:
        with path.open("rb") as file:
            number = {each.name: each.number for each in _header(file.read(HEADER))[1]}
    except (ValueError, LookupError):
        return False
    return "vertex" in number and not number.get("face")


def read_ply(path: Path) -> Soup:
    """Vertices and faces, polygons divided; raises InputError with one sentence."""
    columns, corners, sizes = read_columns(path)
    points = np.stack([columns[axis] for axis in "xyz"], axis=1)
    return triangulated(points, corners, sizes)


def read_columns(path: Path) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Columns (V,) of the vertices by name, (N,) corners and (P,) sizes of all polygons.

    Raises
    ------
    InputError : if the file is damaged, or has no coordinates
    """
    data = path.read_bytes()
    if not data:
        raise InputError("the file is empty")
    columns: dict[str, np.ndarray] = {}
    corners = sizes = np.zeros(0, np.int64)
    try:
        order, elements, begin = _header(data)
        body = _Body(data[begin:], order)
        for element in elements:
            found = _rows(body, element) if element.properties and element.number else {}
            if element.name == "vertex":
                columns = {name: own[0].astype(np.float64) for name, own in found.items()}
            for name in CORNERS if element.name == "face" else ():
                if name in found:
                    sizes, corners = map(_whole, found[name])
        if not columns.keys() >= {*"xyz"}:
            raise ValueError("its vertices have no x, y and z")
    except (ValueError, LookupError, OverflowError) as error:
        raise InputError(f"not a readable PLY file: {brief(error)}") from None
    return columns, corners, sizes


def _header(data: bytes) -> tuple[str, list[Element], int]:
    """Byte order, elements, and size of the header, whose lines may have any order."""
    head, mark, _ = data[:HEADER].partition(b"end_header")
    rows = [line.split() for line in head.decode("latin-1").splitlines()]
    if not mark or rows[:1] != [["ply"]]:
        raise ValueError("it has no header from ply to end_header")
    order, elements = "", []
    for row in rows:
        if row[:1] == ["format"]:
            order = ORDER[row[1]]
        elif row[:1] == ["element"]:
            elements.append(Element(row[1], int(row[2])))
        elif row[:1] == ["property"]:
            kinds = row[2:4] if row[1] == "list" else row[1:2]
            elements[-1].properties.append((row[-1], [KINDS[kind] for kind in kinds]))
    if not order or any(element.number < 0 for element in elements):
        raise ValueError("its header has no format, or a negative number of elements")
    return order, elements, data.index(b"\n", len(head)) + 1


class _Body:
    """The numbers behind the header, taken in sequence."""

    def __init__(self, data: bytes, order: str) -> None:
        self.order, self.at = order, 0
        self.data = np.array(data.split(), np.float64) if order == TEXT else data

    def _taken(self, size: int) -> np.ndarray | bytes:
        if not 0 <= size <= len(self.data) - self.at:
            raise ValueError("it ends before the last of its elements")
        self.at += size
        return self.data[self.at - size : self.at]

    def numbers(self, kind: str, count: int) -> Sequence[float]:
        """Numbers of one type; ValueError if there are fewer."""
        if self.order == TEXT:
            return np.asarray(self._taken(count)).tolist()
        part = bytes(self._taken(count * struct.calcsize("=" + kind)))
        return struct.unpack(f"{self.order}{count}{kind}", part)

    def table(self, kinds: Sequence[str], count: int) -> list[np.ndarray]:
        """Columns of rows of numbers; ValueError if there are fewer rows."""
        if self.order == TEXT:
            return list(np.reshape(self._taken(len(kinds) * count), (count, -1)).T)
        record = np.dtype([(f"f{i}", self.order + kind) for i, kind in enumerate(kinds)])
        rows = np.frombuffer(self._taken(record.itemsize * count), record)
        return [rows[name] for name in record.names or ()]


def _rows(body: _Body, element: Element) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Each property of all elements: values and nothing, or lengths and all items of lists."""
    begin = body.at
    sizes = [len(values) for values in _row(body, element)]
    body.at = begin
    found = _table(body, element, sizes) if sum(sizes) <= WIDEST else []
    if not found:
        body.at = begin
        rows = [list(_row(body, element)) for _ in range(element.number)]
        for own in zip(*rows, strict=True):
            items = [item for values in own for item in values[1:]]
            found.append((np.array([values[0] for values in own]), np.array(items)))
    return {name: own for (name, _), own in zip(element.properties, found, strict=True)}


def _table(
    body: _Body, element: Element, sizes: Sequence[int]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Like `_rows`, at once; empty unless the lists of all elements have the same lengths."""
    found = []
    kinds = [
        kind
        for (_, (kind, *items)), size in zip(element.properties, sizes, strict=True)
        for kind in (kind, *items * (size - 1))
    ]
    try:
        columns = body.table(kinds, element.number)
    except ValueError:
        return []
    for size, (_, own) in zip(sizes, element.properties, strict=True):
        first, *items = columns[:size]
        columns = columns[size:]
        if own[1:] and (first != size - 1).any():
            return []
        found.append((first, np.stack(items, axis=1).ravel() if items else np.zeros(0)))
    return found


def _row(body: _Body, element: Element) -> Iterator[Sequence[float]]:
    """Each property of one element: its value, or the length and the items of a list."""
    for _, kinds in element.properties:
        value = body.numbers(kinds[0], 1)
        yield [*value, *body.numbers(kinds[1], int(value[0]))] if kinds[1:] else value


def _whole(numbers: np.ndarray) -> np.ndarray:
    if not ((np.abs(numbers) < LARGEST) & (numbers == np.floor(numbers))).all():
        raise ValueError("a number or a length of corners is not a whole number")
    return numbers.astype(np.int64)
