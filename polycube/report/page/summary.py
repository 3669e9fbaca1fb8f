"""The page of a batch: a row per part with a link to its report."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from polycube.report.page.html import page
from polycube.report.page.templates import Link, element


def summary_page(rows: Sequence[Mapping[str, object]], columns: Sequence[str], folder: Path) -> str:
    """HTML of the table; "folder" of a row is the folder of its report, below `folder`."""
    shown = [name for name in columns if name != "folder"]
    table = [{name: row.get(name) for name in shown} for row in rows]
    for row, cells in zip(rows, table, strict=True):
        report = f"{row['folder']}/report.html"
        if (folder / report).is_file():
            cells["part"] = Link(str(row["part"]), report)
    return page(f"{len(rows)} parts", element("elements.html", "table", table))
