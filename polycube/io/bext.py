"""Bezier extraction of a cubic spline as text: BEXT v1, as read by LS-DYNA, and v2.

Version 1:

    B E X T / type hex / nodeN n / elemN m / n lines "gnode x y z w" / per element
    "belem f 3 3 3", a line of the f function numbers from 0, and f rows of coefficients:
    "d c0 ... c63" or "s count index value ...", Bezier index i + 4 j + 16 k.

Version 2, with ids from one and shared coefficients, as in the reader of libMesh and its sample:

    B E X T 2.0 / part, nodes, elements, coefficient vectors, 0 (not rational) / nodes "x y z 1" /
    blocks / per block "1 elements functions vectors 3 3 3" / per element its functions, then their
    vectors / "vectors 0" (dense, sparse) / lines "count length" / the vectors.

There is one block for each number of functions of an element. Lines have ten integers or five
floats, and each list starts a new line.

Numbers have 17 digits, so reading returns the written values exactly. Elements are written in
batches of `CHUNK`, so the memory does not grow with the file; version 2 needs two numbers for each
function of an element, and the distinct vectors, which are few.
"""

from collections.abc import Iterator
from itertools import chain, pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix

from polycube.io.atomic import write_parts
from polycube.types import Spline
from polycube.types.spline import ElementFunctions

CHUNK = 256  # elements in a batch
SPARSE = 20  # largest number of coefficients of a row that is written as indices and values


def write_bext(path: Path, spline: Spline) -> Path:
    """Write the spline; 1500 elements take about a second."""
    head = ["B E X T", "type hex", f"nodeN {len(spline.control)}", f"elemN {len(spline.nodes)}"]
    nodes = (f"gnode {x:.17g} {y:.17g} {z:.17g} 1" for x, y, z in spline.control.tolist())
    elements = chain.from_iterable(map(_elements, chunks(spline)))
    return write_parts(path, (f"{line}\n" for line in chain(head, nodes, elements)))


def write_bext2(path: Path, spline: Spline) -> Path:
    """Write the spline as part 1 of version 2."""
    return write_parts(path, _parts(spline))


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
    lines = []
    for first, last in pairwise(coefficients.indptr.tolist()):
        row = dict(zip(index[first:last], text[first:last], strict=True))
        if len(row) <= SPARSE:
            pairs = " ".join(f"{i} {value}" for i, value in row.items())
            lines.append(f"s {len(row)} {pairs}")
        else:
            lines.append(f"d {' '.join(row.get(i, '0') for i in range(64))}")
    return lines


def _parts(spline: Spline) -> Iterator[str]:
    place: dict[bytes, int] = {}  # index of each distinct vector
    counts, functions, numbers = [], [], []
    for chunk in chunks(spline):
        rows = map(np.ndarray.tobytes, chunk.coefficients.toarray())
        numbers.append(np.array([place.setdefault(row, len(place)) for row in rows], np.int32))
        functions.append(chunk.functions.astype(np.int32))
        counts.append(np.diff(chunk.offsets))
    count, function, number = map(np.concatenate, (counts, functions, numbers))
    starts = np.cumsum(count) - count
    sizes = np.unique(count)
    yield "B E X T 2.0\n"
    yield from _integers([1, len(spline.control), len(count), len(place), 0])
    for point in np.column_stack([spline.control, np.ones(len(spline.control))]):
        yield from _floats(point)
    yield from _integers([len(sizes)])
    for size in sizes:
        yield from _integers([1, (count == size).sum(), size, size, 3, 3, 3])
    for size in sizes:
        for first in starts[count == size]:
            own = slice(first, first + size)
            yield from _integers(function[own] + 1)
            yield from _integers(number[own] + 1)
    yield from _integers([1, 0])
    yield from _integers([len(place), 64])
    for vector in place:
        yield from _floats(np.frombuffer(vector))


def _integers(values: np.ndarray | list[int]) -> Iterator[str]:
    return _lines([f"{value:8d}" for value in np.asarray(values).tolist()], 10)


def _floats(values: np.ndarray) -> Iterator[str]:
    return _lines([f"{value:24.16E}" for value in values.tolist()], 5)


def _lines(columns: list[str], number: int) -> Iterator[str]:
    return ("".join(columns[i : i + number]) + "\n" for i in range(0, len(columns), number))
