"""Plugins are found, built by name, and a mistake is answered with what would be right."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from polycube import registry
from polycube.kinds import KINDS
from polycube.registry import build, names, register

ROOT = Path(__file__).parents[1]


def test_names_are_sorted_and_built_in_plugins_are_there() -> None:
    found = names("schedule")
    assert found == sorted(found) and {"cosine", "linear"} <= set(found)


def test_build_hands_over_the_options() -> None:
    plugin = build("schedule", {"plugin": "linear", "steps": 7}, beta_end=0.5)
    assert (plugin.steps, plugin.beta_end) == (7, 0.5)


def test_a_misspelt_name_is_answered_with_the_right_one() -> None:
    with pytest.raises(LookupError, match=r"named 'liner'; have .*linear.*Did you mean 'linear'\?"):
        build("schedule", {"plugin": "liner"})


def test_a_config_without_plugin_is_answered_with_the_names() -> None:
    with pytest.raises(LookupError, match="schedule config names no plugin; have cosine, linear"):
        build("schedule", {"steps": 3})


def test_an_unknown_option_is_answered_with_the_options() -> None:
    with pytest.raises(TypeError, match=r"schedule=linear: .*'stepps'; it takes \(steps"):
        build("schedule", {"plugin": "linear", "stepps": 3})


@pytest.mark.parametrize(
    ("kind", "config", "sentence"),
    [
        ("schedule", {"plugin": "linear", "steps": 2.5}, "steps must be a whole number; got 2.5"),
        ("schedule", {"plugin": "linear", "steps": True}, "steps must be a whole number; got True"),
        ("schedule", {"plugin": "linear", "beta_end": "x"}, "beta_end must be a number; got 'x'"),
        ("spline", {"plugin": "h2s", "single_hex_edges": 1}, "must be true or false; got 1"),
        ("analysis", {"plugin": "modal", "units": 5}, "units must be a word; got 5"),
    ],
)
def test_an_option_of_the_wrong_type_is_refused(kind: str, config: dict, sentence: str) -> None:
    with pytest.raises(TypeError, match=sentence):
        build(kind, config)


def test_an_option_left_open_is_asked_for() -> None:
    with pytest.raises(TypeError, match="structure=given: context must be given"):
        build("structure", {"plugin": "given", "context": "???"}, grid=(2, 1, 1), primitives={})


def test_a_whole_number_is_a_number() -> None:
    assert build("schedule", {"plugin": "linear", "beta_end": 1}).beta_end == 1


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown plugin kind 'scheduler'; kinds are primitive"):
        register("scheduler", "x")


def test_a_name_is_taken_once(own_registry) -> None:
    @register("schedule", "mine")
    @dataclass(frozen=True)
    class First:
        pass

    assert register("schedule", "mine")(First) is First  # a second time, as a reload does
    with pytest.raises(ValueError, match=r"'mine' is registered twice: by .*First and .*Second"):

        @register("schedule", "mine")
        class Second:
            pass


def test_a_strangers_bug_is_named_only_where_it_matters(own_registry) -> None:
    registry._broken["acme"] = ImportError("no module named anvil")
    assert build("schedule", {"plugin": "linear"})
    with pytest.raises(LookupError, match=r"package 'acme' did not import.*anvil"):
        build("schedule", {"plugin": "rocket"})


def test_a_broken_package_does_not_stop_the_others(tmp_path: Path) -> None:
    """A distribution whose import fails: ours are found, and its error is reported."""
    (tmp_path / "anvil.py").write_text("raise RuntimeError('too heavy')")
    info = tmp_path / "anvil-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: anvil\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[polycube.plugins]\nanvil = anvil\n")
    code = (
        f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]\n"
        "from polycube.registry import build, names\n"
        "assert 'linear' in names('schedule')\n"
        "try: build('schedule', {'plugin': 'anvil'})\n"
        "except LookupError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "'anvil' did not import: RuntimeError('too heavy')" in done.stdout


def test_every_plugin_lies_in_the_module_of_its_kind() -> None:
    for kind in KINDS:
        for name in names(kind):
            module = registry._classes[kind, name].__module__
            if module.startswith("polycube.plugins."):
                place = module.removeprefix("polycube.plugins.").replace(".", "/")
                assert place == kind or place.startswith(f"{kind}/"), f"{kind}={name} in {module}"


def test_fields_that_a_run_fills_in_are_no_options() -> None:
    plugin = build("export", {"plugin": "abaqus"})
    assert set(registry.options("export", type(plugin))) == {"element", "step"}
    spline = object()
    given = registry.provide(plugin, spline=spline, something=1)
    assert given.spline is spline and given.problem is None and plugin.spline is None
    medit = build("export", {"plugin": "medit"})
    assert registry.provide(medit, spline=spline) == medit
