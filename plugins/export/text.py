"""Numbers as text, and the templates of the formats."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from polycube.io.atomic import atomic_write

if TYPE_CHECKING:
    from jinja2 import Environment

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


def pointed(value: float) -> str:
    """Nine digits with a decimal point."""
    text = f"{value:.9g}"
    return text if set(text) & set(".e") else f"{text}."


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


def listed(rows: np.ndarray, width: int, between: str, columns: str = "%d") -> str:
    """Numbers from one of rows from zero, in lines of a given length."""
    return wrapped(rows + 1, width, columns, between)


def joined(rows: np.ndarray) -> str:
    """Numbers from one of rows from zero, separated by commas, in lines of sixteen."""
    return wrapped(rows + 1, 16, between=",").strip().replace("\n", ",\n") + "\n"


def numbered_nodes(nodes: np.ndarray, form: str, rows: np.ndarray | None = None) -> str:
    """Numbers of elements, those of `rows` if they are given, and of their nodes, all from one."""
    first = np.arange(len(nodes)) if rows is None else rows
    return lines(np.column_stack([first, nodes]) + 1, form)


def rendered(template: str, **values: object) -> Iterator[str]:
    """The text of a file of the folder `templates`, in parts."""
    return _templates().get_template(template).generate(values)


@cache
def _templates() -> Environment:
    """Jinja2 with the filters that write numbers."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"listed": listed, "rows": lines, "narrow": narrow, "pointed": pointed}
    made.filters |= {"joined": joined, "numbered": numbered_nodes}
    made.filters["short"] = "{:.9g}".format
    return made


def write(path: Path, parts: Iterable[str]) -> Path:
    """Open the file for atomic writing."""
    with (
        atomic_write(path) as temporary,
        open(temporary, "w", encoding="utf-8", newline="\n") as file,
    ):
        file.writelines(parts)
    return path
