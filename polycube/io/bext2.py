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

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix

from polycube.io.atomic import atomic_write
from polycube.io.bext import chunks, share
from polycube.spline.element_faces import unshared_faces
from polycube.types import Spline


def write_bext2(path: Path, spline: Spline, part: int = 1) -> Path:
    """Write the spline as a part with the given number."""
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
    head = [part, len(spline.control), len(count), len(place), 0]
    with (
        atomic_write(path) as temporary,
        open(temporary, "w", encoding="ascii", newline="\n") as file,
    ):
        file.write("B E X T 2.0\n")
        file.writelines(_integers(head))
        for point in np.column_stack([spline.control, np.ones(len(spline.control))]):
            file.writelines(_floats(point))
        file.writelines(_integers([len(sizes)]))
        for size in sizes:
            file.writelines(_integers([1, (count == size).sum(), size, size, 3, 3, 3]))
        for size in sizes:
            for first in starts[count == size]:
                own = slice(first, first + size)
                file.writelines(_integers(function[own] + 1))
                file.writelines(_integers(number[own] + 1))
        file.writelines(_integers([1, 0]))
        file.writelines(_integers([len(place), 64]))
        for vector in place:
            file.writelines(_floats(np.frombuffer(vector)))
    return Path(path)


def read_bext2(path: Path) -> Spline:
    """Read the spline of a cubic BEXT v2 file; Bezier nodes with equal rows are merged.

    Element e is hex e, and faces of only one element are the boundary. Raises ValueError for
    another format, degree or weight and for an incomplete file.
    """
    header, *lines = Path(path).read_text(encoding="ascii").splitlines()
    if header.split() != "B E X T 2.0".split():
        raise ValueError(f"{path} is not a BEXT v2 file: it begins {header!r}")
    text = " ".join(line for line in lines if not line.startswith("$#"))
    numbers = _Numbers(np.array(text.split(), np.float64), path)
    _, n_nodes, _, n_vectors, _ = numbers.integers(5)
    nodes = numbers.take(4 * n_nodes).reshape(-1, 4)
    blocks = numbers.integers(7 * numbers.integers(1)[0]).reshape(-1, 7)
    if (blocks[:, 4:] != 3).any() or (nodes[:, 3] != 1).any():
        raise ValueError(f"{path} is not a cubic BEXT v2 file with weights 1")
    functions, vectors = [], []
    for _, count, size, *_ in blocks:
        table = numbers.integers(2 * count * size).reshape(-1, 2, size) - 1
        functions.append(table[:, 0].ravel())
        vectors.append(table[:, 1].ravel())
    numbers.integers(4)
    return _spline(nodes[:, :3], blocks, functions, vectors, numbers.take(64 * n_vectors))


class _Numbers:
    """All numbers of a file, read in sequence."""

    def __init__(self, values: np.ndarray, path: Path) -> None:
        self.values, self.path = values, path

    def take(self, count: int) -> np.ndarray:
        if len(self.values) < count:
            raise ValueError(f"{self.path} ends too early")
        taken, self.values = self.values[:count], self.values[count:]
        return taken

    def integers(self, count: int) -> np.ndarray:
        return self.take(count).astype(np.int64)


def _spline(
    control: np.ndarray,
    blocks: np.ndarray,
    functions: list[np.ndarray],
    vectors: list[np.ndarray],
    coefficients: np.ndarray,
) -> Spline:
    element = np.repeat(np.arange(blocks[:, 1].sum()), np.repeat(blocks[:, 2], blocks[:, 1]))
    rows = csr_matrix(coefficients.reshape(-1, 64))[np.concatenate(vectors)].tocoo()
    function = np.concatenate(functions)[rows.row]
    shape = (64 * (element[-1] + 1), len(control))
    entries = (rows.data, (64 * element[rows.row] + rows.col, function))
    extraction, nodes = share(csr_matrix(entries, shape))
    nodes = nodes.reshape(-1, 64)
    sides, hexes = unshared_faces(nodes), np.arange(len(nodes))
    return Spline(control, extraction, nodes, hexes, 0 * hexes, sides, np.zeros(len(sides)))


def _integers(values: np.ndarray | list[int]) -> Iterator[str]:
    return _lines([f"{value:8d}" for value in np.asarray(values).tolist()], 10)


def _floats(values: np.ndarray) -> Iterator[str]:
    return _lines([f"{value:24.16E}" for value in values.tolist()], 5)


def _lines(columns: list[str], number: int) -> Iterator[str]:
    return ("".join(columns[i : i + number]) + "\n" for i in range(0, len(columns), number))
