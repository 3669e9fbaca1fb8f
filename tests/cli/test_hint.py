"""The terminal has a warning and a hint for a poor mesh, and for too few hexes in some places."""

import logging

import pytest

from tests.fixtures.runs import run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "size", "is_doubted"), [("key", "20%", True), ("dice", "12%", False)]
)
def test_a_doubt_comes_with_a_hint(part, size, is_doubted, tmp_path, caplog):
    """Large hexes miss the bit of the key."""
    caplog.set_level(logging.INFO)
    report = run(
        f"mesh=example:{part}",
        "structure=slices",
        "order=[meshing]",
        f"meshing.size={size}",
        f"output_dir={tmp_path}",
    )
    hints = [
        m
        for m in caplog.messages
        if m.startswith("hint: try structure=overlay, meshing=parametric")
    ]
    assert bool(report["doubts"]) == bool(hints) == is_doubted
    fewer = {row["kind"] for row in report["hex"]["counts"]["fewer"]}
    lines = [m for m in caplog.messages if m.endswith("they are listed in the report")]
    assert len(lines) == len(fewer)
