import pytest

from polycube.io.lsdyna_deck import write_modal_deck

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


OPTIONS = {"material": {"young": 50, "poisson": 0.3, "density": 1}, "units": "m", "modes": 20}


def test_the_deck_of_the_published_rod(tmp_path):
    path = write_modal_deck(tmp_path / "modal.k", "rod.bext", {**OPTIONS, "mass": "lumped"})
    assert path.read_text() == ROD


def test_the_consistent_mass_is_asked_for(tmp_path):
    path = write_modal_deck(tmp_path / "modal.k", "rod.bext", OPTIONS)
    consistent_mass = "*CONTROL_IMPLICIT_CONSISTENT_MASS\n1\n*END\n"
    assert path.read_text() == ROD.replace("*END\n", consistent_mass)


def test_steel_in_millimetres(tmp_path):
    path = write_modal_deck(tmp_path / "modal.k", "a.bext", {"material": "steel", "units": "mm"})
    assert "*MAT_ELASTIC\n1,7.85e-06,210000000,0.3\n" in path.read_text()
    assert "$ length mm, mass kg, time s\n" in path.read_text()


@pytest.mark.parametrize("units", ["m", "mm", "in"])
def test_the_speed_of_sound_is_that_of_the_material_in_the_units(units, tmp_path):
    metre = {"m": 1, "mm": 1e-3, "in": 0.0254}[units]
    options = {"material": "brass", "units": units, "modes": 7}
    lines = write_modal_deck(tmp_path / "modal.k", "a.bext", options)
    _, density, young, _ = lines.read_text().split("*MAT_ELASTIC\n")[1].split("\n")[0].split(",")
    speed = (float(young) / float(density)) ** 0.5 * metre
    assert speed == pytest.approx((105e9 / 8500) ** 0.5, rel=1e-8)


def test_settings_are_those_of_the_analysis_or_steel_in_millimetres(tmp_path):
    plain = write_modal_deck(tmp_path / "modal.k", "a.bext", {"plugin": "poisson"}).read_text()
    steel = {"material": "steel", "units": "mm", "modes": 20, "mass": "consistent"}
    assert plain == write_modal_deck(tmp_path / "modal.k", "a.bext", steel).read_text()
    own = {"material": "abs", "units": "cm", "modes": 9, "mass": "lumped"}
    found = write_modal_deck(tmp_path / "modal.k", "a.bext", own).read_text()
    assert "*MAT_ELASTIC\n1,0.00105,23000000,0.35\n" in found and "$ length cm" in found
    assert "*CONTROL_IMPLICIT_EIGENVALUE\n9\n*END\n" in found  # without a consistent mass


def test_the_unit_of_the_file_is_used_unless_one_is_given(tmp_path):
    for units, expected in (("auto", "in"), ("m", "m")):
        path = write_modal_deck(tmp_path / "modal.k", "a.bext", {"units": units}, "in")
        assert f"$ length {expected}, mass kg" in path.read_text()
