"""BEXT v1: Bezier extraction of a cubic spline as text, as read by LS-DYNA.

    B E X T / type hex / nodeN n / elemN m / n lines "gnode x y z w" / per element
    "belem f 3 3 3", a line of the f function numbers from 0, and f rows of coefficients:
    "d c0 ... c63" or "s count index value ...", Bezier index i + 4 j + 16 k.

Numbers have 17 digits, so reading returns the written values exactly. Elements are written in
batches of `CHUNK`, so the memory does not grow with the file.
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
