"""BEXT v1: Bezier extraction of a cubic spline as text, as read by LS-DYNA.

    B E X T / type hex / nodeN n / elemN m / n lines "gnode x y z w" / per element
    "belem f 3 3 3", a line of the f function numbers from 0, and f rows of coefficients:
    "d c0 ... c63" or "s count index value ...", Bezier index i + 4 j + 16 k.

Numbers have 17 digits, so reading returns the written values exactly. Elements are written in
batches of `CHUNK`, so the memory does not grow with the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice, pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix

from polycube.io.atomic import atomic_write
from polycube.spline.element_faces import unshared_faces
from polycube.types import Spline
from polycube.types.spline import ElementFunctions

CHUNK = 256  # elements in a batch
SPARSE = 20  # largest number of coefficients of a row that is written as indices and values


def write_bext(path: Path, spline: Spline) -> Path:
    """Write the spline; 1500 elements take about a second."""
    head = ["B E X T", "type hex", f"nodeN {len(spline.control)}", f"elemN {len(spline.nodes)}"]
    nodes = (f"gnode {x:.17g} {y:.17g} {z:.17g} 1" for x, y, z in spline.control.tolist())
    elements = chain.from_iterable(map(_elements, chunks(spline)))
    with (
        atomic_write(path) as temporary,
        open(temporary, "w", encoding="ascii", newline="\n") as file,
    ):
        file.writelines(f"{line}\n" for line in chain(head, nodes, elements))
    return Path(path)


def chunks(spline: Spline) -> Iterator[ElementFunctions]:
    """The functions of all elements, in order, in batches of `CHUNK` elements."""
    for first in range(0, len(spline.nodes), CHUNK):
        yield spline.element_functions(slice(first, first + CHUNK))


def _elements(functions: ElementFunctions) -> Iterator[str]:
    """The lines of elements."""
    rows = _rows(functions.coefficients)
    numbers = list(map(str, functions.functions.tolist()))
    for first, last in pairwise(functions.offsets.tolist()):
        yield f"belem {last - first} 3 3 3"
        yield " ".join(numbers[first:last])
        yield from rows[first:last]


def _rows(coefficients: csr_matrix) -> list[str]:
    """One line per row; equal values are formatted only once."""
    values, inverse = np.unique(coefficients.data, return_inverse=True)
    text = np.array([f"{value:.17g}" for value in values.tolist()], dtype=object)[inverse].tolist()
    index = coefficients.indices.tolist()
    ends = coefficients.indptr.tolist()
    lines = []
    for first, last in pairwise(ends):
        if last - first <= SPARSE:
            pairs = map(" ".join, zip(map(str, index[first:last]), text[first:last], strict=True))
            lines.append(f"s {last - first} {' '.join(pairs)}")
        else:
            row = ["0"] * 64
            for i in range(first, last):
                row[index[i]] = text[i]
            lines.append(f"d {' '.join(row)}")
    return lines


def read_bext(path: Path) -> Spline:
    """Read the spline of a cubic BEXT v1 file; Bezier nodes with equal rows are merged.

    Element e is hex e, and faces of only one element are the boundary. Raises ValueError for
    another format or degree and for an incomplete file.
    """
    tokens = iter(Path(path).read_text().split())
    try:
        _expect(tokens, "B E X T type hex nodeN")
        n_nodes = int(_take(tokens, 1)[0])
        _expect(tokens, "elemN")
        n_elements = int(_take(tokens, 1)[0])
        control = np.array([_node(tokens) for _ in range(n_nodes)])
        rows = [row for e in range(n_elements) for row in _element(tokens, 64 * e, n_nodes)]
    except EOFError:
        raise ValueError(f"{path} ends too early") from None
    except ValueError as error:
        raise ValueError(f"{path} is not a cubic BEXT v1 file: {error}") from None
    node, function, value = np.concatenate(rows, axis=1)
    extraction = csr_matrix(
        (value, (node.astype(int), function.astype(int))), (64 * n_elements, n_nodes)
    )
    distinct, nodes = share(extraction)
    nodes = nodes.reshape(-1, 64)
    sides = unshared_faces(nodes)
    hexes = np.arange(n_elements)
    return Spline(control, distinct, nodes, hexes, 0 * hexes, sides, np.zeros(len(sides)))


def _take(tokens: Iterator[str], count: int) -> list[str]:
    taken = list(islice(tokens, count))
    if len(taken) < count:
        raise EOFError
    return taken


def _expect(tokens: Iterator[str], wanted: str) -> None:
    for want in wanted.split():
        (token,) = _take(tokens, 1)
        if token != want:
            raise ValueError(f"expected {want!r}, found {token!r}")


def _node(tokens: Iterator[str]) -> list[float]:
    _expect(tokens, "gnode")
    *point, weight = map(float, _take(tokens, 4))
    if weight != 1:
        raise ValueError(f"expected weight 1, found {weight}")
    return point


def _element(tokens: Iterator[str], first: int, n_nodes: int) -> Iterator[np.ndarray]:
    """Arrays (3, n) of Bezier node, function and coefficient; nodes are numbered from `first`."""
    _expect(tokens, "belem")
    count = int(_take(tokens, 1)[0])
    _expect(tokens, "3 3 3")
    functions = map(int, _take(tokens, count))
    for function in functions:
        if _take(tokens, 1) == ["d"]:
            index, values = list(range(64)), _take(tokens, 64)
        else:
            pairs = _take(tokens, 2 * int(_take(tokens, 1)[0]))
            index, values = [int(token) for token in pairs[::2]], pairs[1::2]
        row = [(i, function, float(c)) for i, c in zip(index, values, strict=True) if float(c)]
        entries = _checked(np.array(row).reshape(-1, 3).T, n_nodes)
        entries[0] += first
        yield entries


def _checked(row: np.ndarray, n_nodes: int) -> np.ndarray:
    """The row (3, n) of Bezier indices, functions and coefficients; ValueError if out of range."""
    for name, numbers, size in (("Bezier index", row[0], 64), ("function", row[1], n_nodes)):
        if not ((numbers >= 0) & (numbers < size)).all():
            raise ValueError(f"{name} {numbers.max():.0f} is not in 0 to {size - 1}")
    return row


def share(rows: csr_matrix) -> tuple[csr_matrix, np.ndarray]:
    """The distinct rows in order of appearance, and the index of each row among them."""
    rows.sort_indices()
    ends = pairwise(rows.indptr)
    contents = [(rows.indices[a:b].tobytes(), rows.data[a:b].tobytes()) for a, b in ends]
    place: dict[tuple[bytes, bytes], int] = {}
    nodes = np.array([place.setdefault(row, len(place)) for row in contents])
    _, first = np.unique(nodes, return_index=True)
    return rows[first], nodes
