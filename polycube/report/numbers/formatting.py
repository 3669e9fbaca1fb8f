"""Numbers and coordinates as text, and sentences about a solution."""

from collections.abc import Iterator, Sequence

import numpy as np

from polycube.types import Json

N_FREQUENCIES = 3  # number of frequencies in a sentence
VISIBLE = 1e-3  # share of a value below which its error is omitted
TOLERABLE = 0.03  # estimated relative error above which there is a warning


def sentences(report: Json) -> Iterator[str]:
    """The results of the analysis, from the numbers of a report."""
    if "modes" in report:
        found = report["modes"]
        elastic = found["frequency_hz"][found["rigid"] :][:N_FREQUENCIES]
        if elastic:
            errors = plus_minus(max(found.get("frequency_error", ())[:N_FREQUENCIES], default=None))
            yield f"lowest elastic frequencies {', '.join(map(number, elastic))} Hz{errors}"
    elif "static" in report:
        for name, (value, note) in tiles(report).items():
            yield f"{name} {value} {note}"
        yield from singular_stress(report["static"])
    elif "poisson" in report:
        found = report["poisson"]
        unit, place = found["units"], coordinates(found["max_flux_at"])
        error = plus_minus(relative_error(found, "u"))
        yield f"u from {number(found['min_u'])} to {number(found['max_u'])} {unit['u']}{error}"
        yield f"largest flux {number(found['max_flux'])} {unit['flux']} at {place}"


def tiles(report: Json) -> dict[str, tuple[str, str]]:
    """The main numbers of the solution for the top of the page: value and note by name."""
    if "modes" in report:
        modes, unit = report["modes"], report["modes"].get("units", {}).get("frequency", "")
        found = modes["frequency_hz"][modes.get("rigid", 6) :][:N_FREQUENCIES]
        first, *others = [frequency(each, unit) for each in found] or [""]
        note = f"then {', '.join(others)}" if others else ""
        return {"first elastic frequency": (first, note)} if first else {}
    if "static" in report:
        found = report["static"]
        unit = found.get("units", {}).get("length", "")
        error = plus_minus(relative_error(found, "displacement"))
        moved = f"{text(found['max_displacement'])} {unit}{error}"
        place = f"at {coordinates(found['max_von_mises_at'])}"
        on = f" on {found['max_von_mises_on']}" if found["max_von_mises_on"] else ""
        return {
            "largest displacement": (moved, f"at {coordinates(found['max_displacement_at'])}"),
            "largest von Mises stress": (largest(found), place + on),
        }
    if "poisson" in report:
        found = report["poisson"]
        unit = found.get("units", {})
        flux = f"{text(found['max_flux'])} {unit.get('flux', '')}"
        ends = f"{text(found['min_u'])} to {text(found['max_u'])} {unit.get('u', '')}"
        error = plus_minus(relative_error(found, "u"))
        return {"u": (ends.strip() + error, f"largest flux {flux}".strip())}
    return {}


def singular_stress(static: Json) -> Iterator[str]:
    """A sentence about a singular place, where the stress is larger than the largest stress."""
    peak = static["singular"]
    if peak:
        unit = static["units"]["length"]
        place = f"a distance of {number(peak['distance'])} {unit}, at {coordinates(peak['at'])}"
        value = f"at {place}, it is {megapascal(peak['von_mises'])}"
        yield f"at a {peak['what']} the stress is unbounded; {value}"


def relative_error(found: Json, name: str) -> float | None:
    """The estimated error of displacement or u, as a share of its range; None if unknown."""
    error, least = found.get(f"{name}_error"), found.get(f"min_{name}", 0.0)
    return None if error is None else error / max(found[f"max_{name}"] - least, 1e-300)


def plus_minus(error: float | None) -> str:
    """A relative error behind a value; empty if it is unknown or negligible."""
    return f" ± {100 * error:.2g} %" if error is not None and error > VISIBLE else ""


def cautions(report: Json) -> Iterator[str]:
    """Warnings about the results of the analysis, from the numbers of a report."""
    errors = {"frequency": max(report.get("modes", {}).get("frequency_error", ()), default=None)}
    for kind, what in (("static", "displacement"), ("poisson", "u")):
        if kind in report:
            errors[what] = relative_error(report[kind], what)
    functions = report.get("spline", {}).get("functions")
    is_h2s = functions == report.get("hex", {}).get("vertices")  # one function for each vertex
    larger = "spline=optimal" if is_h2s else "spline.refine.levels=1"
    for what, error in errors.items():
        if error is not None and error > TOLERABLE:
            other = larger if what == "frequency" else "spline.refine.levels=1"
            remedy = "use smaller hexes" if "solids" in report else f"use {other} or smaller hexes"
            yield f"the estimated error of a {what} is {100 * error:.2g} %; {remedy}"
    poor = report.get("static", {}).get("poor_elements")
    if poor:
        why = "because their shape is too bad (det J near 0)"
        yield f"the stress in {poor} elements is ignored, {why}; try another meshing.size"


def megapascal(value: float) -> str:
    """Format a stress in Pa as MPa."""
    return f"{number(value / 1e6)} MPa"


def number(value: float) -> str:
    """Format with four digits, or with all digits before the point."""
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e9 else f"{value:.4g}"


def text(value: object) -> str:
    """A number for reading: 12 345, 0.3142; yes and no; – for None; other values as they are."""
    if value is None:
        return "–"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    large = isinstance(value, float | np.floating) and 1e4 <= abs(value) < 1e9
    if large or isinstance(value, int | np.integer):
        return f"{value:,.0f}".replace(",", "\u202f")
    return f"{value:.4g}" if isinstance(value, float | np.floating) else str(value)


def frequency(value: float, unit: str) -> str:
    """A frequency in Hz, kHz or MHz."""
    if unit == "Hz" and value >= 1e4:
        return f"{value / 1e6:.4g} MHz" if value >= 1e6 else f"{value / 1e3:.4g} kHz"
    return f"{text(value)} {unit}".strip()


def percent(share: float | None) -> float | None:
    """A share in per cent; None if it is unknown."""
    return None if share is None else 100 * share


def sentence(phrase: str) -> str:
    """A phrase with a capital letter and a full stop."""
    return phrase[:1].upper() + phrase[1:].rstrip(".") + "."


def largest(static: Json) -> str:
    """The largest stress of a static analysis, with its estimated error unless it is negligible."""
    value, error = static["max_von_mises"], static["max_von_mises_error"] or 0
    return megapascal(value) + (f" ± {error / 1e6:.2g}" if error > VISIBLE * value else "")


def coordinates(at: Sequence[float], size: float = 0.0) -> str:
    """A point as text, with as many digits as its coordinates, or a part of this size, need."""
    size = max(*map(abs, at), size, 1e-300)
    return f"({', '.join(f'{round(x / size, 6) * size + 0.0:.4g}' for x in at)})"
