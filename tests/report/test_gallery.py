"""The gallery: a row and a strip for each run."""

import io
import json
from pathlib import Path

import numpy as np
import pytest

from docs.generators import gallery
from polycube.pipeline.resume.results import save_stage
from polycube.report.pictures.fields import mode
from polycube.structure.rough_map import identity_map
from polycube.types import Candidate, Ranked

REPORT = {
    "polycube": {
        "context": ["cube", None],
        "boxes": 1,
        "chosen": 0,
        "candidates": [{"proposal": "slices"}],
    },
    "hex": {
        "hexes": 12,
        "min_scaled_jacobian": 0.75,
        "mean_scaled_jacobian": 0.9,
        "surface_to_mesh_p99": 0.0123,
    },
}


@pytest.fixture
def finished(run, tmp_path: Path) -> Path:
    """The folder of the run, as far as its hexes."""
    folder = tmp_path / "part"
    candidate = Candidate("slices", run.polycube, identity_map(run.polycube), 0.0, "key")
    positions = np.zeros((len(run.hexes.vertices), 3))
    ranked = [Ranked(candidate, 1.0, {}, run.hexes, positions)]
    save_stage(folder, "read", [run.surface, "part.stl", [], None])
    save_stage(folder, "structure", [ranked, 0])
    save_stage(folder, "meshing/optimize", run.hexes)
    (folder / "report.json").write_text(json.dumps(REPORT))
    return folder


def test_a_run_has_the_pictures_of_what_it_reached(run, finished: Path) -> None:
    assert list(gallery.pictured(finished)) == ["surface", "polycube", "hex", "cut"]
    save_stage(finished, "spline", run.spline)
    save_stage(finished, "analysis", run.solution)
    shown = gallery.pictured(finished)
    assert list(shown)[4:] == ["mode_6"]
    [layer] = shown["mode_6"]
    film = mode(run.spline, run.solution, 6)
    assert np.array_equal(layer.points, film.layer.points + film.shift)


def test_the_page_has_its_row_and_strip(finished: Path, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    file = io.BytesIO()
    image.new("RGB", (400, 300), "red").save(file, "PNG")
    runs = [finished, tmp_path / "no_run"]
    page = gallery.gallery(tmp_path / "docs", runs, lambda found: {"hex": file.getvalue()})
    text = page.read_text()
    assert "| part | cube, – (slices) | 12 | 0.75 / 0.90 | 1.23 |  |  |" in text
    assert "![part](gallery/part.png)" in text and "no_run" not in text
    strip = image.open(tmp_path / "docs" / "gallery" / "part.png").convert("RGB")
    assert strip.size == (4 * gallery.TILE[0], gallery.TILE[1])
    middles = [strip.getpixel((int((k + 0.5) * gallery.TILE[0]), 95)) for k in range(4)]
    white, red = (255, 255, 255), (255, 0, 0)
    assert middles == [white, white, red, white]
