"""A resumed run takes the settings of its loaded stages from the earlier run."""

import json
from functools import cache

import pytest

from polycube.config import compose
from polycube.errors import InputError
from polycube.pipeline.resume.settings import changed_settings, with_earlier_settings
from polycube.pipeline.settings import Settings
from tests.conftest import first_quick

EARLIER = ("mesh=parts/a.stl", "meshing.size=3%", "grid=2x1", "spline=optimal")


@cache
def earlier() -> str:
    return json.dumps(compose("infer", EARLIER))


def resumed(folder, *overrides: str) -> Settings:
    (folder / "config.json").write_text(earlier())
    return with_earlier_settings(Settings.of(compose("infer", [f"resume={folder}", *overrides])))


def test_settings_of_loaded_stages_are_those_of_the_earlier_run(tmp_path):
    settings = resumed(tmp_path, "from=analysis", "analysis.material=brass")
    assert settings.mesh == "parts/a.stl" and settings.grid["shape"] == [2, 1, 1]
    assert settings.meshing["size"] == settings.meshing["subdivide"]["size"] == "3%"
    assert settings.spline["plugin"] == "optimal"
    assert settings.analysis["material"] == "brass"
    assert settings.composed["meshing"]["size"] == "3%"  # as written to config.json


@pytest.mark.slow
def test_settings_of_the_stages_that_run_are_those_of_the_command_line(tmp_path):
    assert resumed(tmp_path, "from=spline").spline["plugin"] == "auto"
    settings = resumed(tmp_path, "from=structure", "meshing.size=2%", "grid=3x1")
    assert settings.meshing["size"] == "2%" and settings.grid["shape"] == [3, 1, 1]
    assert settings.mesh == "parts/a.stl"
    assert resumed(tmp_path, "from=meshing/subdivide", "meshing.size=2%").meshing["size"] == "2%"
    assert resumed(tmp_path, "from=read", "mesh=b.stl").mesh == "b.stl"


@pytest.mark.parametrize(
    ("start", "override", "name"),
    first_quick(
        3,
        [
            ("structure", "mesh=parts/b.stl", "mesh"),
            ("structure", "repair=safe", "repair"),
            ("meshing/subdivide", "grid=3x1", "grid.shape"),
            ("meshing/subdivide", "ckpt=last.ckpt", "ckpt"),
            ("meshing/optimize", "meshing.size=2%", "meshing.size"),
            ("meshing/optimize", "meshing.pillow.patches=all", "meshing.pillow.patches"),
            ("spline", "meshing.size=2%", "meshing.size"),
            ("spline", "meshing.features=soft", "meshing.features"),
            ("spline", "seed=1", "seed"),
            ("analysis", "spline=c0", "spline.plugin"),
        ],
    ),
)
def test_a_setting_without_effect_is_refused(tmp_path, start, override, name):
    with pytest.raises(InputError, match="has no effect, because the result of the resumed") as e:
        resumed(tmp_path, f"from={start}", override)
    assert str(e.value).startswith(f"{name}: ")


@pytest.mark.parametrize(
    ("start", "override"),
    first_quick(
        2,
        [
            ("structure", "mesh=parts/../parts/a.stl"),  # the same file
            ("meshing/optimize", "meshing.features=soft"),  # used by a later stage too
            ("meshing/subdivide", "seed=1"),
            ("spline", "meshing.size=3%"),  # as in the earlier run
            ("analysis", "acceptance.certify=everywhere"),
            ("analysis", "analysis.fixed=[x_min]"),  # also an option of the spline
        ],
    ),
)
def test_a_setting_with_effect_is_accepted(tmp_path, start, override):
    resumed(tmp_path, f"from={start}", override)


def test_without_a_stored_configuration_nothing_is_taken_over(tmp_path):
    settings = Settings.of(compose("infer", [f"resume={tmp_path}", "from=spline"]))
    assert with_earlier_settings(settings) is settings


@pytest.mark.parametrize("text", first_quick(1, ["{", "[]", "\udcff"]))
def test_a_damaged_configuration_is_refused(tmp_path, text):
    (tmp_path / "config.json").write_bytes(text.encode(errors="surrogateescape"))
    settings = Settings.of(compose("infer", [f"resume={tmp_path}", "from=spline"]))
    with pytest.raises(InputError, match=r"config\.json: is damaged.*without resume="):
        with_earlier_settings(settings)


def test_changed_settings_are_those_of_the_stages_to_come():
    before = {"spline": {"plugin": "h2s", "fit": {"rounds": 8}}, "seed": 0}
    now = {"spline": {"plugin": "h2s", "fit": {"rounds": 4}}, "seed": 1}
    assert changed_settings(now, before, ["spline"]) == ["spline.fit.rounds is 4, was 8"]
    assert changed_settings(now, before, ["analysis"]) == []
