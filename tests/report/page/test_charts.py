"""Charts carry the numbers they were given."""

import re

import numpy as np
import pytest
from markupsafe import Markup

from polycube.report.page.hexes import N_BINS, bins_of
from polycube.report.page.templates import element


def histogram(quality: np.ndarray) -> Markup:
    ends = quality.min(), quality.mean()
    return element("charts.html", "histogram", *bins_of(quality), *ends)


def test_histogram_counts_every_hex_and_marks_the_minimum() -> None:
    quality = np.random.default_rng(0).uniform(0.31, 0.99, 500)
    quality[7] = 0.125
    chart = histogram(quality)
    assert sum(map(int, re.findall(r'title="[^"]*: (\d+) hexes', chart))) == 500
    assert sum(map(int, re.findall(r"</td><td>(\d+)</td>", chart))) == 500  # and in words
    assert "min 0.125" in chart and f"mean {quality.mean():.3f}" in chart
    (x,) = re.findall(r'class="mark min" style="left:([\d.]+)%', chart)
    assert float(x) == pytest.approx(12.5)


def test_the_bars_hold_their_ranges_and_colours() -> None:
    chart = histogram(np.array([0.01, 0.99, 0.99]))
    found = re.findall(r'data-low="([^"]*)" data-high="([^"]*)"[^>]*(disabled)?>', chart)
    ends = np.array([each[:2] for each in found], float)
    np.testing.assert_allclose(ends, np.stack([np.arange(20), np.arange(1, 21)], 1) / 20)
    assert chart.count(" disabled>") == 18
    assert re.findall(r"height:([\d.]+)%", chart)[:: N_BINS - 1] == ["50.0", "100.0"]


def test_a_single_bad_hex_can_be_seen() -> None:
    chart = histogram(np.append(np.full(100_000, 0.9), 0.05))
    heights = [float(h) for h in re.findall(r"height:([\d.]+)%", chart)]
    assert min(h for h in heights if h) >= 2 and sum(h > 0 for h in heights) == 2


def test_inverted_hexes_widen_the_axis() -> None:
    chart = histogram(np.array([-0.5, 0.5]))
    assert "min -0.500" in chart and "<span>-1</span>" in chart
    (x,) = re.findall(r'class="mark min" style="left:([\d.]+)%', chart)
    assert float(x) == pytest.approx(25)


def test_bars_are_proportional_to_time() -> None:
    page = element("charts.html", "bars", {"read": 1.0, "meshing/smooth": 4.0})
    assert re.findall(r"width:([\d.]+)%", page) == ["25.0", "100.0"]
    assert "4.0 s" in page


def test_spread_counts_every_hex_and_says_the_worst() -> None:
    chart = element("charts.html", "spread", "edge <ratio>", [1, 2, 3, 4], [5, 0, 1], "worst 3.5")
    assert sum(map(int, re.findall(r": (\d+) hexes", chart))) == 6
    assert "worst 3.5" in chart and "<ratio>" not in chart
    assert re.findall(r"height:([\d.]+)%", chart) == ["100.0", "0.0", "20.0"]
    assert re.findall(
        r"height:([\d.]+)%", element("charts.html", "spread", "skew", [0, 1], [0], "")
    ) == ["0.0"]
