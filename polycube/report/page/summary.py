"""The page of a batch: a row per part with a link to its report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from polycube.report.page.html import page
from polycube.report.page.markup import Link, show


def summary_page(rows: Sequence[Mapping[str, object]], columns: Sequence[str], folder: Path) -> str:
    """HTML of the table; "folder" of a row is the folder of its report, below `folder`."""
    shown = [name for name in columns if name != "folder"]
    head = "".join(f"<th>{escape(name.replace('_', ' '))}</th>" for name in shown)
    body = ""
    for row in rows:
        cells = {name: show(row.get(name)) for name in shown}
        report = f"{row['folder']}/report.html"
        if (folder / report).is_file():
            cells["part"] = show(Link(str(row["part"]), report))
        body += "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells.values()) + "</tr>"
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return page(f"{len(rows)} parts", "", f'<div class="scroll">{table}</div>')
