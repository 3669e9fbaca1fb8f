"""Composing a configuration: the values of conf/, from anywhere in a process, or one sentence."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hypothesis import given
from hypothesis import strategies as st
from omegaconf import OmegaConf

import polycube
from polycube.config import compose, quote
from polycube.errors import InputError
from tests.conftest import ROOT, first_quick

# another program, with a configuration and choices of its own, that composes ours while it runs
PROGRAM = """
import hydra
import polycube
from polycube.config import compose, quote

@hydra.main(version_base=%s, config_path="conf", config_name="other")
def main(cfg):
    found = compose("infer", ["meshing.size=4%%", "spline=c0"])
    assert found["meshing"]["subdivide"]["size"] == "4%%" and found["spline"]["plugin"] == "c0"
    assert "hydra" not in found and "own" not in found and cfg.own == 3
    print(hydra.core.hydra_config.HydraConfig.get().job.name)

main()
"""


@pytest.mark.slow
@pytest.mark.parametrize("version_base", ['"1.3"', '"1.1"', "None"])
def test_another_hydra_program_can_compose_ours(version_base: str, tmp_path: Path) -> None:
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf" / "other.yaml").write_text("own: 1\n")
    (tmp_path / "other.py").write_text(PROGRAM % version_base)
    command = [sys.executable, "other.py", "own=3"]
    done = subprocess.run(
        command, cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["other"]


@pytest.mark.slow
def test_threads_compose_at_the_same_time() -> None:
    sizes = [f"{n}%" for n in range(1, 9)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda size: compose("infer", [f"meshing.size={size}"]), sizes))
    assert [cfg["meshing"]["subdivide"]["size"] for cfg in found] == sizes
    assert not GlobalHydra.instance().is_initialized()


def test_a_mandatory_value_is_shown_as_such() -> None:
    assert compose("infer")["mesh"] == "???"


@pytest.mark.parametrize(
    ("override", "message"),
    first_quick(
        2,
        [
            ("meshing.sze=4%", "no option meshing.sze; did you mean meshing.size; meshing has"),
            ("seed.x=1", "no option seed.x"),
            ("seed=${nothing}", "Interpolation key 'nothing' not found"),
            ("effort=first,normal", "Ambiguous value"),
        ],
    ),
)
def test_a_wrong_override_is_refused_on_one_line(override: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        compose("infer", [override])
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_a_mapping_in_place_of_a_list_is_refused_with_the_right_form_and_the_reverse() -> None:
    load = "{at: z_max, force: [0, 0, -5]}"
    right = f"analysis.loads=[{load}]"
    with pytest.raises(InputError) as caught:
        compose("infer", ["analysis=static", f"analysis.loads={load}"])
    assert str(caught.value) == f"analysis.loads: must be a list; got {load}; write '{right}'"
    loads = compose("infer", ["analysis=static", right])["analysis"]["loads"]
    assert loads == [{"at": "z_max", "force": [0, 0, -5]}]
    with pytest.raises(InputError) as caught:
        compose("infer", ["cad=[2]"])
    assert str(caught.value) == "cad: must be a mapping; got [2]; write 'cad={name: value}'"


@given(st.text(st.sampled_from("ab\\'\"${}:,=[]() \n\x1b\udcff"), min_size=1, max_size=12))
def test_quoted_text_is_taken_literally(text: str) -> None:
    [single] = OverridesParser.create().parse_overrides([f"mesh={quote(text)}"])
    assert OmegaConf.create({"mesh": single.value()}).mesh == text
    [sweep] = OverridesParser.create().parse_overrides([f"mesh={quote(text)},{quote(text)}"])
    again = [f"mesh={each}" for each in sweep.sweep_string_iterator()]
    for override in OverridesParser.create().parse_overrides(again):
        assert OmegaConf.create({"mesh": override.value()}).mesh == text


def test_a_file_name_is_no_interpolation() -> None:
    name = "${oc.env:PATH}.glb"
    assert compose("infer", [f"mesh={quote(name)}"])["mesh"] == name
    with pytest.raises(InputError) as refused:
        polycube.mesh(name)
    assert str(refused.value).startswith(f"{name}: there is no such file")
