import pytest

from polycube.analysis.material import MATERIALS, Material
from polycube.io.lsdyna_deck import settings_of, write_modal_deck

ROD = """\
*KEYWORD 500M
*TITLE
Free vibration modes
$ length m, mass kg, time s
*INCLUDE_TRANSFORM
rod.bext
1,0,1,0,0



*PART
spline
1,1,1
*SECTION_SOLID
1,201
*MAT_ELASTIC
1,1,50,0.3
*CONTROL_IMPLICIT_GENERAL
1,1.
*CONTROL_IMPLICIT_EIGENVALUE
20
*END
"""


def test_the_deck_of_the_published_rod(tmp_path):
    path = write_modal_deck(tmp_path / "modal.k", "rod.bext", Material(50, 0.3, 1), "m", 20, True)
    assert path.read_text() == ROD


def test_the_consistent_mass_is_asked_for(tmp_path):
    path = write_modal_deck(tmp_path / "modal.k", "rod.bext", Material(50, 0.3, 1), "m", 20)
    consistent_mass = "*CONTROL_IMPLICIT_CONSISTENT_MASS\n1\n*END\n"
    assert path.read_text() == ROD.replace("*END\n", consistent_mass)


def test_steel_in_millimetres(tmp_path):
    path = write_modal_deck(tmp_path / "modal.k", "a.bext", MATERIALS["steel"], "mm", 20)
    assert "*MAT_ELASTIC\n1,7.85e-06,210000000,0.3\n" in path.read_text()
    assert "$ length mm, mass kg, time s\n" in path.read_text()


@pytest.mark.parametrize("units", ["m", "mm", "in"])
def test_the_speed_of_sound_is_that_of_the_material_in_the_units(units, tmp_path):
    metre = {"m": 1, "mm": 1e-3, "in": 0.0254}[units]
    lines = write_modal_deck(tmp_path / "modal.k", "a.bext", MATERIALS["brass"], units, 7)
    _, density, young, _ = lines.read_text().split("*MAT_ELASTIC\n")[1].split("\n")[0].split(",")
    speed = (float(young) / float(density)) ** 0.5 * metre
    assert speed == pytest.approx((105e9 / 8500) ** 0.5, rel=1e-8)


def test_settings_are_those_of_the_analysis_or_steel_in_millimetres():
    assert settings_of({"plugin": "poisson"}) == {
        "elastic": MATERIALS["steel"],
        "units": "mm",
        "modes": 20,
        "lumped": False,
    }
    own = {"material": "abs", "units": "cm", "modes": 9, "mass": "lumped"}
    found = settings_of(own)
    assert found == {"elastic": MATERIALS["abs"], "units": "cm", "modes": 9, "lumped": True}
