"""Hints and warnings on the terminal for a mesh with warnings or with few hexes somewhere."""

import logging

import pytest

from tests.fixtures.runs import run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "size", "has_warnings"), [("key", "20%", True), ("dice", "12%", False)]
)
def test_a_mesh_with_warnings_gets_a_hint(part, size, has_warnings, tmp_path, caplog):
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
    assert bool(report["mesh_warnings"]) == bool(hints) == has_warnings
    fewer = {row["kind"] for row in report["hex"]["counts"]["fewer"]}
    lines = [m for m in caplog.messages if m.endswith("they are listed in the report")]
    assert len(lines) == len(fewer)
