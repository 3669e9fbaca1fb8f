"""Charts as SVG text inside the page: they follow its colours and stay sharp on paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from polycube.report.colours import QUALITY_COLOURS, ramp

WIDTH, HEIGHT = 720, 250  # of the histogram, in user units; the page scales it
_FOOT, _HEAD = 34, 34  # room for the axis below and the marks above


def histogram(quality: np.ndarray, bins: int = 40) -> str:
    """Scaled Jacobians as bars in their colours; minimum and mean marked."""
    low = 0.0 if quality.min() >= 0 else -1.0
    count, edges = np.histogram(np.clip(quality, low, 1), bins=bins, range=(low, 1))
    x = (edges - low) / (1 - low) * WIDTH
    tall = (HEIGHT - _FOOT - _HEAD) * count / count.max()
    tall = np.where(count > 0, np.maximum(tall, 2.5), 0)  # a single bad hex must be seen
    middle = (edges[1:] + edges[:-1]) / 2
    bars = [
        f'<rect x="{x[i] + 1:.1f}" y="{HEIGHT - _FOOT - tall[i]:.1f}" '
        f'width="{x[i + 1] - x[i] - 2:.1f}" height="{tall[i]:.1f}" rx="1.5" fill="{_hex(colour)}">'
        f"<title>{edges[i]:.3f} to {edges[i + 1]:.3f}: {count[i]} hexes</title></rect>"
        for i, colour in enumerate(ramp(middle, QUALITY_COLOURS))
        if count[i]
    ]
    ticks = [
        f'<text class="tick" x="{(t - low) / (1 - low) * WIDTH:.1f}" y="{HEIGHT - 10}" '
        f'text-anchor="{anchor}">{t:g}</text>'
        for t, anchor in _ticks(low)
    ]
    marks = [
        _mark((value - low) / (1 - low) * WIDTH, f"{name} {value:.3f}", row, name)
        for row, (name, value) in enumerate((("min", quality.min()), ("mean", quality.mean())))
    ]
    base = HEIGHT - _FOOT
    return (
        f'<svg class="chart" viewBox="-8 0 {WIDTH + 16} {HEIGHT}" role="img" '
        f'aria-label="histogram of scaled Jacobians, minimum {quality.min():.3f}">'
        f'<line class="axis" x1="0" y1="{base}" x2="{WIDTH}" y2="{base}"/>'
        f"{''.join(bars)}{''.join(ticks)}{''.join(marks)}</svg>"
    )


def spread(name: str, edges: Sequence[float], counts: Sequence[int], worst: str) -> str:
    """A small histogram; the outer bars hold what lies beyond.

    worst : said above it
    """
    width, base, tall = 340, 120, 80
    most = max([*counts, 1])
    step = width / len(counts)
    bars = [
        f'<rect x="{i * step + 0.5:.1f}" y="{base - max(tall * n / most, 2.5):.1f}" '
        f'width="{step - 1:.1f}" height="{max(tall * n / most, 2.5):.1f}" rx="1">'
        f"<title>{edges[i]:.3g} to {edges[i + 1]:.3g}: {n} hexes</title></rect>"
        for i, n in enumerate(counts)
        if n
    ]
    return (
        f'<svg class="spread" viewBox="-4 0 {width + 8} {base + 24}" role="img" '
        f'aria-label="histogram of {escape(name)}, {escape(worst)}">'
        f'<text class="name" x="0" y="16">{escape(name)}</text>'
        f'<text class="tick" x="{width}" y="16" text-anchor="end">{escape(worst)}</text>'
        f'<line class="axis" x1="0" y1="{base}" x2="{width}" y2="{base}"/>{"".join(bars)}'
        f'<text class="tick" x="0" y="{base + 18}">{edges[0]:g}</text>'
        f'<text class="tick" x="{width}" y="{base + 18}" text-anchor="end">{edges[-1]:g}</text>'
        "</svg>"
    )


def _ticks(low: float) -> list[tuple[float, str]]:
    values = np.linspace(low, 1, 6 if low == 0 else 5)
    return [(v, "start" if v == low else "end" if v == 1 else "middle") for v in values]


def _mark(x: float, text: str, row: int, name: str) -> str:
    right = x < WIDTH - 110
    y = 14 + 17 * row
    return (
        f'<g class="mark {name}"><line x1="{x:.1f}" y1="{y - 11}" x2="{x:.1f}" '
        f'y2="{HEIGHT - _FOOT}"/><text x="{x + (6 if right else -6):.1f}" y="{y}" '
        f'text-anchor="{"start" if right else "end"}">{text}</text></g>'
    )


def bars(seconds: Mapping[str, float]) -> str:
    """Seconds per stage as horizontal bars, in the order they ran."""
    longest = max([*seconds.values(), 1e-9])
    rows = [
        f'<div class="bar"><span>{escape(name)}</span><span class="track"><i style="width:'
        f'{100 * spent / longest:.1f}%"></i></span><b>{spent:.1f} s</b></div>'
        for name, spent in seconds.items()
    ]
    return f'<div class="bars">{"".join(rows)}</div>'


def _hex(colour: np.ndarray) -> str:
    return "#" + "".join(f"{int(c):02x}" for c in colour)
