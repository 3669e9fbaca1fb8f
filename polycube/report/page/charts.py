"""Charts of the page: histograms and bars."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from markupsafe import Markup

from polycube.report.page.templates import element
from polycube.report.pictures.colours import QUALITY_COLOURS, ramp

N_BINS = 20  # bars of the histogram: wide enough for touch screens


def histogram(quality: np.ndarray, bins: int = N_BINS) -> Markup:
    """Histogram of scaled Jacobians in colour, with minimum and mean marked.

    Every bar is a button with its range, used by the 3D view; a table has the numbers.
    """
    low = 0.0 if quality.min() >= 0 else -1.0
    counts, edges = np.histogram(np.clip(quality, low, 1), bins=bins, range=(low, 1))
    colours = ramp((edges[1:] + edges[:-1]) / 2, QUALITY_COLOURS)
    found = _bars(edges, counts)
    for i, bar in enumerate(found):
        bar |= {"low": f"{edges[i]:.4f}", "high": f"{edges[i + 1]:.4f}"}
        bar["colour"] = f"#{colours[i].tobytes().hex()}"
    marks = []
    for name, value, turn in (("min", quality.min(), 0.25), ("mean", quality.mean(), 0.75)):
        share = (value - low) / (1 - low)  # the text is on the side with more space
        mark = {"name": name, "value": f"{value:.3f}", "percent": f"{100 * share:.2f}"}
        marks.append({**mark, "is_left": share > turn})
    ticks = [f"{tick:g}" for tick in np.linspace(low, 1, 6 if low == 0 else 5)]
    least = f"{quality.min():.3f}"
    chart = {"bars": found, "marks": marks, "ticks": ticks, "least": least}
    return element("charts.html", "histogram", chart)


def spread(name: str, edges: Sequence[float], counts: Sequence[int], worst: str) -> Markup:
    """A small histogram; the outer bars include values outside.

    worst : text above it
    """
    ticks = [f"{edges[0]:g}", f"{edges[-1]:g}"]
    chart = {"name": name, "worst": worst, "bars": _bars(edges, counts), "ticks": ticks}
    return element("charts.html", "spread", chart)


def bars(seconds: Mapping[str, float]) -> Markup:
    """Seconds per stage as horizontal bars, in the order of the stages."""
    longest = max([*seconds.values(), 1e-9])
    rows = [
        (name, f"{spent:.1f}", f"{100 * spent / longest:.1f}") for name, spent in seconds.items()
    ]
    return element("charts.html", "bars", rows)


def _bars(edges: Sequence[float] | np.ndarray, counts: Iterable[int]) -> list[dict[str, object]]:
    """The bars of a histogram; a single bad hex is visible."""
    counts = list(map(int, counts))
    most = max([*counts, 1])
    found: list[dict[str, object]] = []
    for i, count in enumerate(counts):
        between = f"{edges[i]:.3g} to {edges[i + 1]:.3g}"
        height = f"{max(100 * count / most, 2.0) if count else 0.0:.1f}"
        title = f"{between}: {count} hexes"
        found.append({"range": between, "title": title, "count": count, "height": height})
    return found
