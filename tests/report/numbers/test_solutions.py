"""The solid at rest and potentials in report.json, on the page, in pictures and as files."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.io.bezier import write_solution
from polycube.registry import build
from polycube.report.numbers import formatting, solutions
from polycube.report.page import sections as page
from polycube.report.pictures import fields
from polycube.report.pictures.fields import tessellate
from polycube.report.pictures.pictures import makers, pictures
from polycube.state import RunState
from tests.fixtures.splines import BAR
from tests.fixtures.stages import TETRAHEDRON


@pytest.fixture(scope="module")
def warm(bar):
    ends = [{"at": "x_min", "value": 10.0}, {"at": "x_max", "value": 30.0}]
    return build("analysis", {"plugin": "poisson", "fixed": ends})(bar)


def test_numbers_of_a_pulled_bar(bar, pulled):
    [(name, found)] = solutions.numbers(bar, pulled).items()
    assert name == "static"
    assert found["max_displacement"] == pytest.approx(np.hypot(0.04, 0.3 * 0.01 * np.sqrt(2)))
    assert found["max_displacement_at"] == pytest.approx(BAR)
    assert found["max_von_mises"] == pytest.approx(2.1e9)
    assert [row["at"] for row in found["reactions"]] == ["x_min", "y_min", "z_min", "x_max"]
    assert found["reactions"][3]["force"] == pytest.approx([2100.0, 0, 0], abs=1e-6)
    assert found["units"]["stress"] == "Pa"
    assert found["stress_error"] < 1e-9 and found["max_von_mises_error"] < 1
    assert found["singular"] is None and found["poor_elements"] == 0
    assert found["max_von_mises_on"] in {
        f"{axis}_{end}" for axis in "xyz" for end in ("min", "max")
    }


@pytest.fixture(scope="module")
def bent(bar):
    loads = [{"at": "x_max", "force": [0.0, 0.0, -100.0]}]
    return build("analysis", {"plugin": "static", "fixed": ["x_min"], "loads": loads})(bar)


def test_sentences_about_a_bent_bar(bar, bent):
    report = solutions.numbers(bar, bent)
    found = report["static"]
    moved, stressed, singular = formatting.sentences(report)
    off = 100 * found["displacement_error"] / found["max_displacement"]
    size = f"{found['max_displacement']:.4g} mm ± {off:.2g} %"
    assert moved.startswith(f"largest displacement {size} at (4, ") and 0.1 < off < 3
    value, error = found["max_von_mises"] / 1e6, found["max_von_mises_error"] / 1e6
    assert stressed.startswith(f"largest von Mises stress {value:.4g} MPa ± {error:.2g} at (1, ")
    assert stressed.endswith(f" on {found['max_von_mises_on']}")
    assert singular.startswith("at a border of x_min the stress is unbounded; at a distance of ")
    peak = found["singular"]
    assert 0 <= peak["at"][0] <= 1  # in the first element
    border = min(*(abs(x - end) for x in peak["at"][1:] for end in (0, 1)))
    assert np.hypot(border, peak["at"][0]) == pytest.approx(peak["distance"], rel=0.1)
    assert f"of {peak['distance']:.4g} mm, at (" in singular
    assert singular.endswith(f"it is {peak['von_mises'] / 1e6:.4g} MPa")
    text, tile = page_of(bar, bent)
    assert "At a border of x_min the stress is unbounded" in text
    assert tile["largest von Mises stress"][0] == f"{value:.4g} MPa ± {error:.2g}"
    assert tile["largest displacement"][0] == size
    assert tile["largest displacement"][1].startswith("at (4, ")
    assert list(formatting.cautions(report)) == []


def test_badly_shaped_elements_give_a_warning(bar, bent):
    report = solutions.numbers(bar, replace(bent, poor=3))
    [caution] = formatting.cautions(report)
    assert caution.startswith("the stress in 3 elements is ignored, because their shape is too bad")
    assert "The stress in 3 elements is ignored" in page.solution(bar, bent, report, {})


def test_sentences_about_modes_and_potentials(bar, warm):
    modes = build("analysis", {"plugin": "modal", "modes": 8})(bar)
    modes = replace(modes, errors=(0.002, 0.005))
    first, second = modes.frequency[6:8]
    report = solutions.numbers(bar, modes)
    [sentence] = formatting.sentences(report)
    assert sentence == f"lowest elastic frequencies {first:.0f}, {second:.0f} Hz ± 0.5 %"
    assert list(formatting.cautions(report)) == []
    stiff = solutions.numbers(bar, replace(modes, errors=(0.05, 0.01)))
    [sentence] = formatting.sentences(stiff)
    assert sentence.endswith(f"{second:.0f} Hz ± 5 %")
    [caution] = formatting.cautions(stiff)
    assert caution.startswith("the estimated error of a frequency is 5 %; use spline=optimal or")
    larger = stiff | {"hex": {"vertices": 45}, "spline": {"functions": 175}}
    [caution] = formatting.cautions(larger)
    assert caution.endswith("use spline.refine.levels=1 or smaller hexes")
    values, flux = formatting.sentences(solutions.numbers(bar, warm))
    assert values == "u from 10 to 30 K"
    assert flux.startswith("largest flux 250000 W/m^2 at (")
    assert list(formatting.sentences({})) == [] == list(formatting.cautions({}))


def test_numbers_of_a_warm_bar(bar, warm):
    [(name, found)] = solutions.numbers(bar, warm).items()
    assert name == "poisson"
    assert [found["min_u"], found["max_u"]] == pytest.approx([10, 30])
    assert found["max_u_at"][0] == pytest.approx(4.0)
    assert found["max_flux"] == pytest.approx(50 * 20 / 0.004)
    assert [row["flow"] for row in found["flows"]] == pytest.approx([-0.25, 0.25])


def page_of(spline, solution):
    report = solutions.numbers(spline, solution)
    return page.solution(spline, solution, report, {}), formatting.tiles(report)


def test_the_page_lists_reactions_and_flows(bar, pulled, warm):
    text, tile = page_of(bar, pulled)
    assert "<td>x_max</td><td>2100</td>" in text and "2100 MPa" in text
    assert tile["largest von Mises stress"][0] == "2100 MPa"
    text, tile = page_of(bar, warm)
    assert "<td>x_min</td><td>-0.25</td>" in text
    assert tile == {"u": ("10 to 30 K", "largest flux 250\u202f000 W/m^2")}
    assert page.solution(None, None, {}, {}) == "" and formatting.tiles({}) == {}


def test_preloads_are_in_the_report_and_on_the_page(bar, pulled):
    bolt = {"point": [1.5, 0.5, 0.5], "axis": [1, 0, 0], "force": 2100.0}
    ends = [{"at": place, "components": place[0]} for place in ("x_min", "x_max", "y_min", "z_min")]
    found = build("analysis", {"plugin": "static", "fixed": ends, "preloads": [bolt]})(bar)
    [row] = solutions.numbers(bar, found)["static"]["preloads"]
    assert row == {
        "force": 2100.0,
        "section_force": pytest.approx(2100.0),
        "tightening": pytest.approx(0.04),
    }
    text, _ = page_of(bar, found)
    assert "<td>1</td><td>2100</td><td>2100</td><td>0.04</td>" in text
    assert "Preloads" not in page_of(bar, pulled)[0]


def test_scenes_move_and_colour_the_solid(bar, pulled, warm):
    (layer,) = fields.deformed(bar, pulled)
    still = tessellate(bar).points @ (bar.extraction @ bar.control)
    moved = np.linalg.norm(layer.points - still, axis=1)
    assert moved.max() == pytest.approx(0.08 * np.linalg.norm(BAR))
    assert np.ptp(layer.colours.astype(int), axis=0).max() <= 1  # one stress all over
    (layer,) = fields.potential(bar, warm)
    cold, hot = layer.colours[layer.points[:, 0] == 0], layer.colours[layer.points[:, 0] == 4]
    assert (cold[:, 2] > cold[:, 0]).all() and (hot[:, 0] > hot[:, 2]).all()


@pytest.mark.slow
def test_pictures_are_named_by_the_analysis(bar, pulled, warm):
    pytest.importorskip("pyvista")
    assert set(pictures(RunState(TETRAHEDRON, spline=bar, solution=pulled))) >= {"spline", "static"}
    assert set(makers(RunState(TETRAHEDRON, spline=bar, solution=warm))) >= {"spline", "poisson"}


def test_fields_in_the_files(bar, pulled, warm, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    write_solution(tmp_path, bar, pulled)
    write_solution(tmp_path, bar, warm)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["poisson.vtu", "static.vtu"]
    at_rest = pyvista.read(tmp_path / "static.vtu")
    assert set(at_rest.point_data) == {"displacement", "stress", "von_mises"}
    assert at_rest["stress"].shape == (at_rest.n_points, 6)
    assert at_rest["stress"][:, 0] == pytest.approx(np.full(at_rest.n_points, 2.1e9))
    assert at_rest["displacement"][:, 0] == pytest.approx(0.01 * at_rest.points[:, 0], abs=1e-9)
    potential = pyvista.read(tmp_path / "poisson.vtu")
    assert potential["u"] == pytest.approx(10 + 5 * potential.points[:, 0])
    assert potential["flux"].shape == (potential.n_points, 3)
