"""Charts as markup of the page, with its colours and font sizes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from polycube.report.pictures.colours import QUALITY_COLOURS, ramp

N_BINS = 20  # bars of the histogram: wide enough for touch screens


def histogram(quality: np.ndarray, bins: int = N_BINS) -> str:
    """Histogram of scaled Jacobians in colour, with minimum and mean marked.

    Every bar is a button with its range, used by the 3D view; a table has the numbers.
    """
    low = 0.0 if quality.min() >= 0 else -1.0
    count, edges = np.histogram(np.clip(quality, low, 1), bins=bins, range=(low, 1))
    colours = ramp((edges[1:] + edges[:-1]) / 2, QUALITY_COLOURS)
    buttons = "".join(
        f'<button type="button" data-low="{edges[i]:.4f}" data-high="{edges[i + 1]:.4f}" '
        f'title="{_bin(edges, i)}: {n} hexes" aria-label="{_bin(edges, i)}: {n} hexes"'
        f'{"" if n else " disabled"}><i style="height:{_tall(n, count.max()):.1f}%;'
        f'background:{_hex(colours[i])}"></i></button>'
        for i, n in enumerate(count)
    )
    ticks = np.linspace(low, 1, 6 if low == 0 else 5)
    marks = [
        _mark((value - low) / (1 - low), f"{name} {value:.3f}", name)
        for name, value in (("min", quality.min()), ("mean", quality.mean()))
    ]
    rows = "".join(
        f"<tr><td>{_bin(edges, i)}</td><td>{n}</td></tr>" for i, n in enumerate(count) if n
    )
    return (
        f'<div class="histogram" role="group" aria-label="histogram of scaled Jacobians, '
        f'minimum {quality.min():.3f}"><div class="bins">{buttons}</div>{"".join(marks)}</div>'
        f"{_axis([f'{tick:g}' for tick in ticks])}"
        "<details><summary>The numbers of the histogram</summary>"
        f'<table class="numbers"><thead><tr><th>scaled Jacobian</th><th>hexes</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></details>"
    )


def spread(name: str, edges: Sequence[float], counts: Sequence[int], worst: str) -> str:
    """A small histogram; the outer bars include values outside.

    worst : text above it
    """
    most = max([*counts, 1])
    bars = "".join(
        f'<i title="{_bin(edges, i)}: {n} hexes" style="height:{_tall(n, most):.1f}%"></i>'
        for i, n in enumerate(counts)
    )
    return (
        f'<div class="spread" role="img" aria-label="histogram of {escape(name)}, {escape(worst)}">'
        f'<div class="ends"><b>{escape(name)}</b><span>{escape(worst)}</span></div>'
        f'<div class="bins">{bars}</div>{_axis([f"{edges[0]:g}", f"{edges[-1]:g}"])}</div>'
    )


def _bin(edges: Sequence[float] | np.ndarray, i: int) -> str:
    return f"{edges[i]:.3g} to {edges[i + 1]:.3g}"


def _tall(count: int, most: int) -> float:
    """Per cent of the height of the chart; a single bad hex must be visible."""
    return max(100 * count / most, 2.0) if count else 0.0


def _axis(ticks: Sequence[str]) -> str:
    return f'<div class="ends">{"".join(f"<span>{tick}</span>" for tick in ticks)}</div>'


def _mark(share: float, text: str, name: str) -> str:
    """A dashed line at a share of the width, with its text on the side with more space."""
    left = share > 0.25 if name == "min" else share > 0.75
    side = " left" if left else ""
    return f'<div class="mark {name}{side}" style="left:{100 * share:.2f}%"><b>{text}</b></div>'


def bars(seconds: Mapping[str, float]) -> str:
    """Seconds per stage as horizontal bars, in the order of the stages."""
    longest = max([*seconds.values(), 1e-9])
    rows = [
        f'<div class="bar"><span>{escape(name)}</span><span class="track"><i style="width:'
        f'{100 * spent / longest:.1f}%"></i></span><b>{spent:.1f} s</b></div>'
        for name, spent in seconds.items()
    ]
    return f'<div class="bars">{"".join(rows)}</div>'


def _hex(colour: np.ndarray) -> str:
    return "#" + "".join(f"{int(c):02x}" for c in colour)
