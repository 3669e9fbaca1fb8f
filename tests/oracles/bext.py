"""Readers of BEXT files of version 1 and 2."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix

from polycube.spline.boundary import unshared_faces
from polycube.types import Spline


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


def share(rows: csr_matrix) -> tuple[csr_matrix, np.ndarray]:
    """The distinct rows in order of appearance, and the index of each row among them."""
    rows.sort_indices()
    ends = pairwise(rows.indptr)
    contents = [(rows.indices[a:b].tobytes(), rows.data[a:b].tobytes()) for a, b in ends]
    place: dict[tuple[bytes, bytes], int] = {}
    nodes = np.array([place.setdefault(row, len(place)) for row in contents])
    _, first = np.unique(nodes, return_index=True)
    return rows[first], nodes
