"""Charts carry the numbers they were given."""

import re

import numpy as np
import pytest

from polycube.report import charts


def test_histogram_counts_every_hex_and_marks_the_minimum() -> None:
    quality = np.random.default_rng(0).uniform(0.31, 0.99, 500)
    quality[7] = 0.125
    svg = charts.histogram(quality)
    assert sum(map(int, re.findall(r": (\d+) hexes", svg))) == 500
    assert "min 0.125" in svg and f"mean {quality.mean():.3f}" in svg
    (x,) = re.findall(r'class="mark min"><line x1="([\d.]+)"', svg)
    assert float(x) == pytest.approx(0.125 * charts.WIDTH, abs=0.1)


def test_a_single_bad_hex_can_be_seen() -> None:
    svg = charts.histogram(np.append(np.full(100_000, 0.9), 0.05))
    heights = [float(h) for h in re.findall(r'height="([\d.]+)" rx', svg)]
    assert len(heights) == 2 and min(heights) >= 2


def test_inverted_hexes_widen_the_axis() -> None:
    svg = charts.histogram(np.array([-0.5, 0.5]))
    assert "min -0.500" in svg and ">-1</text>" in svg
    (x,) = re.findall(r'class="mark min"><line x1="([\d.]+)"', svg)
    assert float(x) == pytest.approx(charts.WIDTH / 4, abs=0.1)


def test_bars_are_proportional_to_time() -> None:
    page = charts.bars({"read": 1.0, "meshing/smooth": 4.0})
    assert re.findall(r"width:([\d.]+)%", page) == ["25.0", "100.0"]
    assert "4.0 s" in page


def test_spread_counts_every_hex_and_says_the_worst() -> None:
    svg = charts.spread("edge <ratio>", [1, 2, 3, 4], [5, 0, 1], "worst 3.5")
    assert sum(map(int, re.findall(r": (\d+) hexes", svg))) == 6
    assert svg.count("<rect") == 2 and "worst 3.5" in svg and "<ratio>" not in svg
    tall = [float(h) for h in re.findall(r'height="([\d.]+)" rx', svg)]
    assert tall[0] == 80 and tall[1] == 80 / 5
    assert charts.spread("skew", [0, 1], [0], "").count("<rect") == 0
