"""Docstrings and signatures as Markdown."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence

SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
ENTRY = re.compile(r"^(\S.*?)(?: : (.*))?$")
WIDTH = 90  # largest width of a call on one line
MADE = (
    "<!-- Made by `python -m docs.generators.reference docs`; change the code, not this page. -->"
)


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; bars in the cells are escaped."""
    lines = [heads, ["---"] * len(heads), *([cell(each) for each in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def cell(text: str) -> str:
    """A text in one line of a table; HTML tags outside of code are escaped."""
    line = " ".join(text.split()).replace("|", "\\|")
    return line if line.startswith("`") else line.replace("<", "\\<")


def sentence(text: str) -> str:
    """The first paragraph of a docstring."""
    return " ".join(inspect.cleandoc(text or "").partition("\n\n")[0].split())


def docstring(thing: object) -> str:
    """A numpydoc docstring: paragraphs, then a list for each section."""
    text = inspect.cleandoc(getattr(thing, "__doc__", "") or "")
    before, *rest = SECTION.split(text)
    parts = [before.strip()]
    for title, body in zip(rest[::2], rest[1::2], strict=True):
        if title == "Examples":
            code = re.sub(r"  # doctest:.*", "", body).strip()
            parts.append(f"```\n{code}\n```")
        else:
            parts.append(f"*{title}*\n\n{_entries(body)}")
    return "\n\n".join(part for part in parts if part)


def signature(function: object, name: str) -> str:
    """A call as code, without `self` and modules of types; a long one has a line per parameter."""
    found = inspect.signature(function)  # type: ignore[arg-type]
    parameters = [each for each in found.parameters.values() if each.name != "self"]
    call = name + _plain(str(found.replace(parameters=parameters)))
    if len(call) > WIDTH:
        opened = re.sub(r", (?=[*]{0,2}\w+: |[*],)", ",\n    ", call)
        call = opened.replace("(", "(\n    ", 1).replace(") -> ", ",\n) -> ")
    return f"```python\n{call}\n```"


def _plain(text: str) -> str:
    return re.sub(r"[a-z_.]+[.](?=[A-Z])", "", text.replace("'", ""))


def _entries(body: str) -> str:
    """The entries of a section, whose indented lines continue an entry; other text is unchanged."""
    if " : " not in body and "\n " not in body:
        return " ".join(body.split())
    lines: list[str] = []
    for line in body.strip().splitlines():
        if line.startswith(" ") and lines:
            lines[-1] += f" {line.strip()}"
        elif line.strip():
            found = ENTRY.match(line)
            name, text = found.groups() if found else (line, "")
            lines.append(f"* `{name}`: {text}" if text else f"* {name}:")
    return "\n".join(lines)
