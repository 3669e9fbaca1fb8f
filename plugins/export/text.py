"""Numbers as text."""

from collections.abc import Iterable
from io import StringIO
from pathlib import Path

import numpy as np

from polycube.io.atomic import atomic_write

WIDTH = 20  # characters of a field in a deck of Abaqus


def count(rows: np.ndarray) -> np.ndarray:
    """Rows with a first column of numbers, from one."""
    return np.column_stack([np.arange(1, len(rows) + 1), rows])


def floats(values: np.ndarray) -> str:
    """Rows of numbers that are read as the same bits."""
    return lines(values, "%.17g")


def integers(values: np.ndarray, between: str = " ") -> str:
    """Rows of integers."""
    return lines(values, "%d", between)


def numbered(points: np.ndarray, between: str = ", ") -> str:
    """Points that are read as the same bits, with their number from one."""
    return lines(count(points), ["%d"] + 3 * ["%.17g"], between)


def narrow(value: float) -> str:
    """A number with as many digits, at most 17, as a field of `WIDTH` characters permits."""
    texts = (f"{value:.{digits}g}" for digits in range(17, 0, -1))
    return next(text for text in texts if len(text) <= WIDTH)


def lines(values: np.ndarray, form: str | list[str], between: str = " ") -> str:
    """Rows in a format of `numpy.savetxt`."""
    text = StringIO()
    np.savetxt(text, values, form, between)
    return text.getvalue()


def wrapped(numbers: Iterable[int], width: int, columns: str = "%d", between: str = "") -> str:
    """Integers in lines of a given length."""
    numbers = list(numbers)
    rows = (numbers[i : i + width] for i in range(0, len(numbers), width))
    return "".join(between.join(columns % n for n in row) + "\n" for row in rows)


def write(path: Path, *parts: str) -> Path:
    """Open the file for atomic writing."""
    with (
        atomic_write(path) as temporary,
        open(temporary, "w", encoding="utf-8", newline="\n") as file,
    ):
        file.writelines(parts)
    return path
