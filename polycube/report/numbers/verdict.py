"""The verdict on a run, its reasons and main numbers, from the numbers of report.json."""

from dataclasses import dataclass

from polycube.report.numbers import features, formatting
from polycube.report.numbers.formatting import sentence, text
from polycube.report.numbers.quality import SPLINE_LIMIT
from polycube.types import Goal, Json
from polycube.units import described, resolved

GOOD, WARNING, BAD, PLAIN = "good", "warning", "bad", ""
CALM = "calm"  # mark of a sentence without a sign
ALL_PASSED = (
    "All checks passed: worst hex, distances to the input and volume are within their limits."
)

UNKNOWN = "model units"  # length unit of a part without analysis


@dataclass(frozen=True)
class Tile:
    """One of the main numbers; `note` explains it."""

    value: str
    name: str
    note: str = ""
    mark: str = PLAIN


def verdict(report: Json) -> tuple[str, str]:
    """Mark and text of the verdict on the mesh."""
    if report.get("partly_fitted"):
        return BAD, "Hex mesh without inverted hexes, only partly fitted"
    if not report.get("valid"):
        return BAD, "No valid hex mesh of all solids" if "solids" in report else "No valid result"
    if reasons(report):
        return WARNING, "Valid hex mesh with warnings"
    return GOOD, "Valid hex mesh"


def why(report: Json) -> tuple[str, list[str]]:
    """Mark and sentences of the reasons for the verdict."""
    failure = [report["failure"]] if report.get("failure") else []
    sentences = [sentence(reason) for reason in (*failure, *reasons(report))]
    if sentences:
        return BAD if failure else WARNING, sentences
    return CALM, [ALL_PASSED] if report.get("valid") else []


def reasons(report: Json) -> list[str]:
    """All warnings about a valid mesh, one sentence each."""
    stopped = [str(report["stopped"])] if report.get("stopped") else []
    return [*stopped, *report.get("mesh_warnings", ())]


def _worst(report: Json) -> list[Tile]:
    numbers = report.get("hex", {})
    least = numbers.get("min_scaled_jacobian")
    if least is None:
        return []
    limit = _limit(report, "poor_jacobian")
    mark = BAD if least <= 0 else WARNING if least < limit else GOOD
    mean = numbers.get("mean_scaled_jacobian")
    note = f"1 for a cube, limit {limit:g}" + (f"; mean {mean:.3f}" if mean else "")
    return [Tile(f"{least:.3f}", "worst scaled Jacobian", note, mark)]


def _limit(report: Json, name: str) -> float:
    """A limit of the acceptance of this run; the default one for a report without it."""
    return report.get("config", {}).get("acceptance", {}).get(name, getattr(Goal, name))


def _count(report: Json) -> list[Tile]:
    numbers = report.get("hex", {})
    if "hexes" not in numbers:
        return []
    certificate, mark, note = numbers.get("certificate"), PLAIN, ""
    if certificate:
        everywhere = certificate["positive_everywhere"]
        corners = certificate["positive_at_corners"]
        mark = GOOD if everywhere else WARNING if corners else BAD
        where = "everywhere (proved)" if everywhere else "at corners" if corners else "not in all"
        note = f"Jacobian positive: {where}"
    return [Tile(text(numbers["hexes"]), "hexes", note, mark)]


def _distance(report: Json) -> list[Tile]:
    numbers = report.get("hex", {})
    ways = ("mesh_to_surface", "surface_to_mesh")
    both = [numbers.get(f"{way}_max") for way in ways]
    if None in both:
        return []
    notes, diagonal = [], numbers.get("deviation", {}).get("diagonal")
    value = f"{100 * max(both):.2f} % of the diagonal"
    if diagonal:
        notes.append(value)
        value = f"{text(max(both) * diagonal)} {length_unit(report)}"
    p99 = [numbers.get(f"{way}_p99") for way in ways]
    if None not in p99:
        notes.append(f"99 % of the points within {100 * max(p99):.2g} %")
    limit = _limit(report, "distance_limit")
    notes.append(f"limit {100 * limit:g} %")
    is_far = any("apart" in reason or "largest distance" in reason for reason in reasons(report))
    mark = BAD if max(both) >= limit else WARNING if is_far else GOOD
    return [Tile(value, "largest distance from the input", "; ".join(notes), mark)]


def _volume(report: Json) -> list[Tile]:
    error = report.get("hex", {}).get("volume_error")
    if error is None:
        return []
    limit = _limit(report, "far_volume")
    mark = WARNING if error >= limit else GOOD
    return [Tile(f"{100 * error:.2f} %", "volume error", f"limit {100 * limit:g} %", mark)]


def _features(report: Json) -> list[Tile]:
    """Preserved points, curves and faces of a CAD model."""
    found = report.get("hex", {}).get("features")
    if not found:
        return []
    counts = {kind: found[kind] for kind in ("points", "curves", "faces")}
    preserved = {kind: each["all"] - each["lost"] for kind, each in counts.items()}
    total = sum(each["all"] for each in counts.values())
    note = ", ".join(f"{preserved[kind]} of {each['all']} {kind}" for kind, each in counts.items())
    limit = f"within {features.limit(found)}"
    mark = GOOD if sum(preserved.values()) == total else WARNING
    value = f"{sum(preserved.values())} of {total}"
    return [Tile(value, "CAD features preserved", f"{note}; {limit}", mark)]


def _spline(report: Json) -> list[Tile]:
    numbers = report.get("spline", {})
    if "surface_to_spline_p99" not in numbers:
        return []
    p99 = max(numbers["surface_to_spline_p99"], numbers["spline_to_surface_p99"])
    is_positive = numbers["is_positive"]
    mark = GOOD if is_positive and p99 < SPLINE_LIMIT else WARNING
    least = f"smallest det J {numbers['min_scaled_detj']:.3f} of its mean"
    sign = least if is_positive else "det J not positive"
    note = f"{text(numbers['functions'])} functions; {sign}"
    value = share = f"{100 * p99:.2g} % of the diagonal"
    diagonal = report.get("hex", {}).get("deviation", {}).get("diagonal")
    if diagonal:
        value, note = f"{text(p99 * diagonal)} {length_unit(report)}", f"{share}; {note}"
    name = "spline from the input, 99 % of points"
    return [Tile(value, name, f"limit {100 * SPLINE_LIMIT:g} %; {note}", mark)]


TILES = (_worst, _features, _count, _distance, _volume, _spline)


def tiles(report: Json) -> list[Tile]:
    """The main numbers of a run."""
    found = [tile for make in TILES for tile in make(report)]
    of_solution = formatting.tiles(report).items()
    return found + [Tile(value, name, note) for name, (value, note) in of_solution]


def length_unit(report: Json) -> str:
    """Length unit of the coordinates from the analysis, else of the file, else "model units"."""
    for name in ("modes", "static", "poisson"):
        unit = report.get(name, {}).get("units", {}).get("length")
        if unit:
            return str(unit)
    given, of_file = _units(report)
    return resolved(given, of_file) if given or of_file else UNKNOWN


def about(report: Json) -> dict[str, str | None]:
    """Size, unit, origin and time of a run, by name; None where unknown."""
    found, made = report.get("input", {}), report.get("made", {})
    spent, unit = sum(report.get("seconds", {}).values()), length_unit(report)
    version, box, date = report.get("version"), found.get("bbox"), made.get("date", "")
    sides = [text(high - low) for low, high in zip(*box, strict=True)] if box else []
    seed = f", seed {report['seed']}" if "seed" in report else ""
    return {
        "size": f"{' × '.join(sides)} {unit}" if box else None,
        "length unit": "unknown" if unit == UNKNOWN else described(*_units(report)),
        # 2026-01-31T12:34:56+01:00 as 2026-01-31 12:34 +01:00
        "date": f"{date[:10]} {date[11:16]} {date[19:]}".strip() or None,
        "made by": f"polycube {version}{seed}" if version else None,
        "machine": made.get("machine"),
        "time of the stages": f"{spent:.1f} s" if spent else None,
    }


def _units(report: Json) -> tuple[str | None, str]:
    """The unit given by the analysis, and that of the file."""
    given = (report.get("config", {}).get("analysis") or {}).get("units")
    return given, report.get("input", {}).get("unit") or ""
