"""Numbers as text, and the templates of the formats."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jinja2 import Environment

EXACT = "%.17g"  # numbers that are read as the same bits
WIDTH = 20  # characters of a field in a deck of Abaqus


def count(rows: np.ndarray) -> np.ndarray:
    """Rows with a first column of numbers, from one."""
    return np.column_stack([np.arange(1, len(rows) + 1), rows])


def narrow(value: float) -> str:
    """A number with as many digits, at most 17, as a field of `WIDTH` characters permits."""
    texts = (f"{value:.{digits}g}" for digits in range(17, 0, -1))
    return next(text for text in texts if len(text) <= WIDTH)


def pointed(value: float) -> str:
    """Nine digits with a decimal point."""
    text = f"{value:.9g}"
    return text if set(text) & set(".e") else f"{text}."


def lines(values: np.ndarray, form: str = "%d") -> str:
    """Rows in a format of `numpy.savetxt`; by default integers."""
    text = StringIO()
    np.savetxt(text, values, form)
    return text.getvalue()


def listed(rows: np.ndarray, width: int, between: str, columns: str = "%d") -> str:
    """Numbers from one of rows from zero, in lines of a given length."""
    numbers = [columns % (row + 1) for row in rows]
    parts = (numbers[i : i + width] for i in range(0, len(numbers), width))
    return "".join(between.join(part) + "\n" for part in parts)


def joined(rows: np.ndarray) -> str:
    """Numbers from one of rows from zero, separated by commas, in lines of sixteen."""
    return listed(rows, 16, ",").strip().replace("\n", ",\n") + "\n"


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
