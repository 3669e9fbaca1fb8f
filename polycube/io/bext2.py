"""BEXT v2: Bezier extraction of a cubic spline as text, ids from one, coefficients shared.

    B E X T 2.0 / part, nodes, elements, coefficient vectors, 0 (not rational) / nodes "x y z 1" /
    blocks / per block "1 elements functions vectors 3 3 3" / per element its functions, then their
    vectors / "vectors 0" (dense, sparse) / lines "count length" / the vectors.

There is one block for each number of functions of an element. Lines have ten integers or five
floats, and each list starts a new line, as in the reader of libMesh and its sample file. Floats
have 17 digits.

Elements are extracted in batches. The memory for all elements is two numbers for each of their
functions, and the distinct vectors, which are few.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from polycube.io.atomic import write_parts
from polycube.io.bext import chunks
from polycube.types import Spline


def write_bext2(path: Path, spline: Spline) -> Path:
    """Write the spline as part 1."""
    return write_parts(path, _parts(spline))


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
