"""The page of a benchmark: totals with the published ones, a row and a picture per part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from polycube.report.numbers.benchmark import PUBLISHED, PartResult, changes, totals
from polycube.report.numbers.features import KINDS
from polycube.report.page.html import page
from polycube.report.page.markup import Pictures, figure, grid, section, show, swatches, table
from polycube.report.pictures.colours import LOST, SURFACE

SOURCE = (
    "Published: the frame-field pipeline that the HexMe paper tests on its 189 tetrahedral meshes "
    "of 63 CAD models (Beaufort et al. 2022, “Hex Me If You Can”). Here a feature is kept if "
    "it is within 0.3 % of the bounding-box diagonal of the mesh. A part without a valid mesh "
    "keeps no feature, and a part without points, such as a sphere, is not in the mean of points. "
    "Medians are of parts with a valid mesh. SJ: scaled Jacobian."
)
LEGEND = (
    "<p class=note>p99: 99th percentile of the distance, the larger of both directions, in per "
    "cent of the diagonal.</p>"
)
COMPARED = " Before is {}."


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
    return page(
        f"Benchmark {name}",
        "",
        section("totals", "Totals", *_totals(parts, before, earlier))
        + section("failures", "No valid mesh", _failures(parts))
        + section("parts", "Parts", table([_row(part, before) for part in parts]), LEGEND)
        + section("pictures", "Pictures", *_pictures(parts, pictures)),
        subtitle=f"{show(valid)} of {show(len(parts))} parts have a valid hex mesh",
    )


def _totals(
    parts: Sequence[PartResult], before: Mapping[str, PartResult] | None, earlier: str
) -> list[str]:
    columns = {"here": totals(parts)}
    if before is not None:
        both = [part for part in parts if part.name in before]
        columns["parts of both, here"] = totals(both)
        columns["parts of both, before"] = totals([before[part.name] for part in both])
    columns["published"] = dict(PUBLISHED)
    rows = [
        {"": name, **{head: _rounded(column.get(name)) for head, column in columns.items()}}
        for name in columns["here"]
    ]
    note = SOURCE + COMPARED.format(earlier) * (before is not None)
    return [table(rows), f"<p class=note>{escape(note)}</p>"]


def _rounded(value: float | None) -> float | None:
    return value if value is None else round(value, None if value >= 100 else 1)


def _failures(parts: Sequence[PartResult]) -> str:
    failed = [part for part in parts if not part.is_valid]
    rows = [{"part": p.name, "result": p.row["result"], "why": p.row["says"]} for p in failed]
    return table(rows) if rows else ""


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


def _pictures(parts: Sequence[PartResult], pictures: Pictures) -> list[str]:
    legend = swatches(["boundary of the hex mesh", "what is lost, seen through"], [SURFACE, LOST])
    cards = [_card(pictures.get(part.name), _caption(part)) for part in parts]
    return [legend, grid(*cards)]


def _card(picture: bytes | None, caption: str) -> str:
    """A picture above its caption; only the caption if there is no picture."""
    alone = f"<figure><figcaption>{escape(caption)} No picture.</figcaption></figure>"
    return figure(picture, caption) or alone


def _caption(part: PartResult) -> str:
    if not part.is_valid:
        return f"{part.name}: {part.row['result']}. {part.row['says']}".rstrip(". ") + "."
    numbers = [f"{n} {kind}{'s' * (n != 1)}" for kind, n in part.lost.items() if n]
    lost = f"loses {', '.join(numbers)}" if numbers else "keeps everything" * bool(part.features)
    return f"{part.name}: {', '.join(filter(None, [lost, f'least SJ {part.least:.2f}']))}."
