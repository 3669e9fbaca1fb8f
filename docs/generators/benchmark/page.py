"""The page of a benchmark: totals with the published ones, a row and a picture per part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from jinja2 import FileSystemLoader
from markupsafe import Markup

from docs.generators.benchmark.numbers import PUBLISHED, PartResult, changes, totals
from polycube.report.numbers.features import KINDS
from polycube.report.page.html import page
from polycube.report.page.templates import FOLDER, Pictures, Row, environment, show


def benchmark_page(
    name: str,
    parts: Sequence[PartResult],
    pictures: Pictures,
    before: Mapping[str, PartResult] | None = None,
    earlier: str = "",
) -> str:
    """HTML of a benchmark.

    Parameters
    ----------
    name : name of the batch
    parts : parts in the order of the page
    pictures : PNG by the name of the part
    before : parts by name, of the batch for comparison
    earlier : name of that batch
    """
    valid = sum(part.is_valid for part in parts)
    folders = FileSystemLoader([Path(__file__).parent, FOLDER])
    template = environment().overlay(loader=folders).get_template("benchmark.html")
    body = template.render(
        totals=_totals(parts, before),
        earlier=None if before is None else earlier,
        failures=_failures(parts),
        parts=[_row(part, before) for part in parts],
        pictures=[(pictures.get(part.name), _caption(part)) for part in parts],
    )
    subtitle = f"{show(valid)} of {show(len(parts))} parts have a valid hex mesh"
    return page(f"Benchmark {name}", Markup(body), subtitle=subtitle)


def _totals(parts: Sequence[PartResult], before: Mapping[str, PartResult] | None) -> list[Row]:
    columns = {"here": totals(parts)}
    if before is not None:
        both = [part for part in parts if part.name in before]
        columns["parts of both, here"] = totals(both)
        columns["parts of both, before"] = totals([before[part.name] for part in both])
    columns["published"] = dict(PUBLISHED)
    return [
        {"": name, **{head: _rounded(column.get(name)) for head, column in columns.items()}}
        for name in columns["here"]
    ]


def _rounded(value: float | None) -> float | None:
    return value if value is None else round(value, None if value >= 100 else 1)


def _failures(parts: Sequence[PartResult]) -> list[Row]:
    failed = [part for part in parts if not part.is_valid]
    return [{"part": p.name, "result": p.row["result"], "why": p.row["says"]} for p in failed]


def _row(part: PartResult, before: Mapping[str, PartResult] | None) -> dict[str, object]:
    has_mesh = "hexes" in part.row
    row = {
        "part": part.name,
        "result": part.row["result"],
        **{f"{kind}s lost": _lost(part, kind) for kind in KINDS},
        "least SJ": round(part.least, 3) if has_mesh else None,
        "mean SJ": round(part.row["mean_scaled_jacobian"], 3) if has_mesh else None,
        "p99, %": part.farthest if part.farthest is None else round(part.farthest, 3),
        "hexes": part.row.get("hexes"),
        "seconds": part.row.get("seconds"),
    }
    if before is not None:
        quality, lost = changes(part, before.get(part.name))
        row |= {"SJ change": quality, "lost change": lost}
    return row


def _lost(part: PartResult, kind: str) -> str | None:
    """Lost and total number of features of a kind; None if the part is not a CAD model."""
    if not part.features:
        return None
    return f"{part.lost[kind]} of {part.features[f'{kind}s']['all']}"


def _caption(part: PartResult) -> str:
    if not part.is_valid:
        return f"{part.name}: {part.row['result']}. {part.row['says']}".rstrip(". ") + "."
    numbers = [f"{n} {kind}{'s' * (n != 1)}" for kind, n in part.lost.items() if n]
    lost = f"loses {', '.join(numbers)}" if numbers else "keeps everything" * bool(part.features)
    return f"{part.name}: {', '.join(filter(None, [lost, f'least SJ {part.least:.2f}']))}."
