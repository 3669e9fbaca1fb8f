"""The page: well-formed, self-contained, complete, and also written for incomplete runs."""

import base64
import re
from pathlib import Path

import numpy as np
import pytest

from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.page.html import header, write_report
from polycube.report.page.templates import element, show
from polycube.report.pictures.pictures import makers
from polycube.state import RunState
from tests.fixtures.html import Outline
from tests.fixtures.stages import TETRAHEDRON

EMPTY = RunState(TETRAHEDRON)


@pytest.fixture(scope="module")
def report(run) -> dict[str, object]:
    surface, hexes, modes = run.surface, run.hexes, run.solution
    quality = scaled_jacobian(hexes.vertices, hexes.hexes)
    box = [surface.vertices.min(0).tolist(), surface.vertices.max(0).tolist()]
    candidate = {"proposal": "slices", "context": ["cube", "hole_z"], "key": "k", "score": 0.25}
    return {
        "valid": True,
        "input": {"path": "parts/<b>bent.stl", "vertices": 72, "genus": 1, "bbox": box},
        "polycube": {
            "grid": [2, 1, 1],
            "candidates": [candidate],
            "chosen": 0,
            "context": ["cube", "hole_z"],
            "denoised_to_polycube_mean": 0.026,
            "denoised_to_polycube_max": 0.161,
            "denoised_lies_on": ["hole_z", None],
        },
        "hex": {
            "hexes": len(hexes.hexes),
            "min_scaled_jacobian": float(quality.min()),
            "mean_scaled_jacobian": float(quality.mean()),
            "mesh_to_surface_max": 0.0025,
            "surface_to_mesh_max": 0.0031,
        },
        "spline": {"functions": 468},
        "modes": {
            "omega_squared": modes.eigenvalues.tolist(),
            "frequency_hz": modes.frequency.tolist(),
            "units": modes.units,
        },
        "seconds": {"read": 0.5, "meshing/smooth": 9.5},
        "warnings": ["3 vertices <welded>"],
        "seed": 7,
        "version": "0.1.0",
        "config": {
            "grid": {"shape": [2, 1, 1]},
            "mesh": "bent.stl",
            "meshing": {"order": []},
            "spline": {"plugin": "h2s"},
            "analysis": {"plugin": "modal"},
        },
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="module")
def images(run) -> dict[str, bytes]:
    """The first bytes of each picture, as if it were drawn; test_browser.py has real ones."""
    return {name: b"GIF89a" if name.startswith("mode") else b"\x89PNG" for name in makers(run)}


@pytest.fixture(scope="module")
def page(run, report, images, folder: Path, written) -> str:
    (folder / "hex.vtu").write_text("")
    return written(folder, run, report, images).read_text(encoding="utf-8")


def test_all_sections_in_order(page: str) -> None:
    wanted = "view warnings hexes spline modes input structure denoising search settings files"
    assert Outline(page).sections == wanted.split()


def test_the_page_needs_no_other_file(page: str) -> None:
    addresses = Outline(page).addresses
    assert all(re.match("data:image/(png|gif);base64,", a) or "/" not in a for a in addresses)
    assert "http:" not in page.replace("http://www.w3.org", "") and "https:" not in page


def test_numbers_of_the_run_stand_in_the_page(page: str, run) -> None:
    text = " ".join(Outline(page).text)
    quality = scaled_jacobian(run.hexes.vertices, run.hexes.hexes)
    assert "Valid hex mesh" in text
    assert f"min {quality.min():.3f}" in text
    diagonal = np.linalg.norm(np.ptp(run.surface.vertices, axis=0))
    assert "0.31" in text and f"{0.0031 * diagonal:.4g}" in text  # per cent, and model units
    assert f"{run.solution.frequency[6]:.4g} Hz" in text
    assert "rigid motion" in text and "3 vertices <welded>" in text
    assert re.search(r"shape: \[2, 1, 1\]", text)


def test_text_from_outside_is_escaped(page: str) -> None:
    assert "<b>bent" not in page and "<welded>" not in page


def test_a_run_that_failed_half_way_says_where(run, images, written, tmp_path) -> None:
    report = {
        "valid": False,
        "failure": "stage meshing/smooth failed: no descent",
        "input": {"path": "part.stl", "bbox": [[0, 0, 0], [1, 1, 1]]},
        "seconds": {"read": 0.1},
    }
    state = RunState(run.surface, polycube=run.polycube)
    few = {name: images[name] for name in ("input", "polycube")}
    page = written(tmp_path, state, report, few).read_text(encoding="utf-8")
    outline = Outline(page)
    assert "No valid result" in page and "Stage meshing/smooth failed" in page
    assert {"input", "structure"} <= set(outline.sections)
    assert not {"hexes", "spline", "modes"} & set(outline.sections)


def test_the_warnings_about_a_valid_mesh_are_listed(tmp_path: Path) -> None:
    report = {"valid": True, "mesh_warnings": ["the volume is 93% of the surface's"]}
    page = write_report(tmp_path, EMPTY, report, False).read_text(encoding="utf-8")
    assert "Valid hex mesh with warnings" in page
    assert "The volume is 93% of the surface" in page


@pytest.mark.parametrize(
    ("corners", "everywhere", "where"),
    [
        (True, True, "everywhere (proved)"),
        (True, False, "at corners"),
        (False, False, "not in all"),
    ],
)
def test_the_header_says_where_the_jacobian_is_positive(corners, everywhere, where) -> None:
    certificate = {"positive_at_corners": corners, "positive_everywhere": everywhere}
    page = header({"valid": True, "hex": {"hexes": 8, "certificate": certificate}})
    assert f"Jacobian positive: {where}<" in page
    assert "Jacobian positive" not in header({"valid": True, "hex": {"hexes": 8}})


@pytest.mark.parametrize(
    ("numbers", "mark"),
    [
        ({"min_scaled_jacobian": 0.5}, "good"),
        ({"min_scaled_jacobian": 0.1}, "warning"),
        ({"min_scaled_jacobian": -0.1}, "bad"),
        ({"volume_error": 0.01}, "good"),
        ({"volume_error": 0.05}, "warning"),
        ({"mesh_to_surface_max": 0.01, "surface_to_mesh_max": 0.02}, "good"),
        ({"mesh_to_surface_max": 0.01, "surface_to_mesh_max": 0.05}, "bad"),
    ],
)
def test_a_number_beyond_its_limit_is_marked(numbers, mark) -> None:
    assert f'<div class="tile {mark}">' in header({"valid": True, "hex": numbers})


def test_a_spline_is_judged_by_its_sign_and_its_distance() -> None:
    spline = {"is_positive": True, "min_scaled_detj": 0.1, "functions": 9}
    spline |= {"surface_to_spline_p99": 0.001, "spline_to_surface_p99": 0.002}
    assert 'tile good"><span>spline' in header({"spline": spline})
    assert 'tile warning"><span>spline' in header({"spline": {**spline, "is_positive": False}})
    far = {**spline, "surface_to_spline_p99": 0.02}
    assert 'tile warning"><span>spline' in header({"spline": far})


def test_an_empty_report_gives_a_page(tmp_path: Path) -> None:
    Outline(write_report(tmp_path, EMPTY, {}, False).read_text(encoding="utf-8"))


def test_the_context_of_a_large_lattice_is_abbreviated(tmp_path: Path) -> None:
    many = {"context": ["cube", None] * 9}
    report = {"polycube": {**many, "candidates": [{**many, "score": 1.0}]}}
    text = " ".join(Outline(write_report(tmp_path, EMPTY, report, False).read_text("utf-8")).text)
    assert text.count("bricks in 9 of 18 cells") == 2 and "cube, –" not in text


def test_values_are_formatted() -> None:
    assert show(12345) == "12\u202f345"
    assert show(np.float64(0.314159)) == "0.3142"
    assert show(304180.2) == "304\u202f180" and show(1e12) == "1e+12"
    assert show(True) == "yes" and show(None) == "–"
    assert show(("cube", None)) == "cube, –"
    assert show({"length": "m<m"}) == "length m&lt;m"


def test_table_has_every_column_any_row_has() -> None:
    rows = element("elements.html", "table", [{"a": 1}, {"a": 2, "b": 3}], 1)
    assert rows.count("<th>") == 2 and rows.count("<td>") == 4
    assert rows.index("class=chosen") > rows.index("<td>1</td>")


def test_a_denoising_is_in_the_page_and_in_its_folder(page: str, folder: Path) -> None:
    assert "Their distance from it is 0.026 cells on average, 0.161 at most." in page
    assert "They are on another polycube, hole_z, None." in page
    image = base64.b64encode((folder / "trajectory.png").read_bytes()).decode()
    assert f"data:image/png;base64,{image}" in page
    assert '<a href="trajectory.png">' in page
