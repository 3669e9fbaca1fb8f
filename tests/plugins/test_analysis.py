import logging
from dataclasses import asdict
from pathlib import Path

import pytest
import yaml

from polycube.io.hexes import boundary
from polycube.registry import build
from tests.hex_solids import hex_box

CONF = Path(__file__).parents[2] / "conf"


def modal(**options):
    return build("analysis", {"plugin": "modal", **options})


@pytest.fixture(scope="module")
def spline():
    mesh = hex_box((4, 1, 1), (100.0, 20.0, 10.0))
    return build("spline", {"plugin": "h2s"})(boundary(mesh), mesh)


def test_config_holds_the_defaults():
    config = yaml.safe_load((CONF / "analysis" / "modal.yaml").read_text())
    assert config == {"plugin": "modal", **asdict(modal())}


def test_steel_bar(spline, caplog):
    with caplog.at_level(logging.INFO):
        modes = modal(modes=10)(spline)
    assert modes.mass == pytest.approx(0.1 * 0.02 * 0.01 * 7850, rel=1e-9)
    assert modes.shapes.shape == (10, len(spline.control), 3)
    assert "mass 0.157 kg; elastic modes at" in caplog.text


def test_named_material_and_its_numbers_are_the_same(spline):
    steel = {"young": 210e9, "poisson": 0.3, "density": 7850}
    named, given = modal(modes=8)(spline), modal(modes=8, material=steel)(spline)
    assert given.eigenvalues.tolist() == named.eigenvalues.tolist()
    assert modal(modes=8, material="aluminium")(spline).mass < 0.4 * named.mass


def test_options_reach_the_solver(spline):
    plain = modal(modes=8)(spline).frequency[7]
    assert modal(modes=8, units="m")(spline).frequency[7] == pytest.approx(plain / 1000, rel=1e-9)
    assert modal(modes=8, mass="lumped")(spline).frequency[7] < plain
    coarse = modal(modes=8, gauss=2)(spline).frequency[7]
    assert coarse != plain and coarse == pytest.approx(plain, rel=0.1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"material": "wood"}, "material must be one of steel, .*; got 'wood'"),
        ({"material": {"young": 1}}, "material must be .*; got {'young': 1}"),
        ({"material": {"young": -1, "poisson": 0.3, "density": 1}}, "material needs young > 0"),
        ({"units": "parsec"}, "units must be one of m, .*; got 'parsec'"),
        ({"mass": "row"}, "mass must be consistent or lumped; got 'row'"),
        ({"modes": 0}, "modes >= 1 and gauss >= 2 are needed; got 0, 4"),
        ({"gauss": 1}, "got 20, 1"),
    ],
)
def test_refuses_options_with_a_reason(options, message):
    with pytest.raises(ValueError, match=message):
        modal(**options)
