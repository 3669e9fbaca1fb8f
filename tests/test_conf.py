"""The plugin classes are the schema of conf/: names, defaults and help stand in them alone."""

import json
from dataclasses import asdict
from functools import reduce
from itertools import zip_longest
from operator import getitem
from pathlib import Path

import pytest
import yaml
from hydra.types import RunMode
from omegaconf import OmegaConf

from polycube.cli.help import described
from polycube.config import SEVERAL, SHARED, compose, loader, options_of
from polycube.kinds import KINDS
from polycube.registry import PROVIDED, build, classes, default, options
from tests.conftest import ROOT, first_quick

CONF = ROOT / "conf"
PLUGINS = sorted(key for key, cls in classes().items() if cls.__module__.startswith("polycube."))
SCHEMAS = [*PLUGINS, *SHARED]
PROGRAMS = ("infer", "train", "evaluate")
GIVEN = {"grid": (2, 1, 1), "primitives": {}}  # what a run provides
NEEDED = {"context": ["cube"]}  # options without a default


def composed(kind: str, name: str) -> dict[str, object]:
    """The options of a plugin as a run has them when nothing is chosen."""
    config = loader().load_configuration(f"{kind}/{name}", [], RunMode.RUN)
    node = OmegaConf.select(config, kind.replace("/", "."))
    found = OmegaConf.to_container(node, resolve=True)
    return found[name] if kind in SEVERAL else found


@pytest.mark.parametrize(("kind", "name"), first_quick(20, PLUGINS), ids=map("=".join, PLUGINS))
def test_the_defaults_of_a_class_are_those_of_a_run(kind: str, name: str) -> None:
    given = {key: GIVEN[key] for key in PROVIDED.get(kind, ())}
    config = composed(kind, name)
    needed = {key: NEEDED[key] for key, value in config.items() if value == "???"}
    plugin = build(kind, config | needed, **given)
    alone = build(kind, {"plugin": name, **needed}, **given)
    for option in options(kind, type(plugin)).values():
        values = [_plain(getattr(each, option.name)) for each in (plugin, alone)]
        if "choice" in option.metadata:  # here a run shows the inner options too
            assert values[0].items() >= values[1].items()
        else:
            assert values[0] == values[1], option.name
    assert config["plugin"] == name
    assert set(config) == {"plugin", *options(kind, type(plugin))}


def _plain(value: object) -> object:
    return json.loads(json.dumps(value, default=asdict))


@pytest.mark.parametrize(("kind", "name"), SCHEMAS, ids=map("=".join, SCHEMAS))
def test_every_option_has_a_help_text(kind: str, name: str) -> None:
    cls = {**SHARED, **classes()}[kind, name]
    first = cls.__doc__.partition("\n")[0]
    assert 5 < len(first) < 100 and first.endswith("."), first
    bare = [option for option, text in described(kind, cls).items() if len(text) < 5]
    assert not bare, f"{kind}={name}: no line in the Parameters of its docstring for {bare}"


def test_no_file_repeats_a_class() -> None:
    for kind, name in PLUGINS:
        assert not (CONF / kind / f"{name}.yaml").exists(), f"{kind}={name}"


def choices(program: str) -> dict[str, list[str]]:
    """The names that the command line may choose for each group."""
    search = loader()
    known = search.compute_defaults_list(program, [], RunMode.RUN).overrides.known_choices
    keys = [key for key in known if not key.startswith("hydra/")]
    return {key: options_of(search, key.partition("@")[0]) for key in keys}


@pytest.mark.parametrize("program", first_quick(1, ["evaluate", "train", "infer"]))
def test_every_choice_composes_and_builds(program: str) -> None:
    """Every plugin in the config, wherever it stands; the n-th choices of all groups together."""
    given = choices(program)
    for experiment in given.pop("experiment", []):
        compose(program, [f"experiment={experiment}"])
    inner = [key for key in given if "@" in key]  # of plugins that a choice may replace
    for keys in ([key for key in given if key not in inner], inner):
        for row in zip_longest(*(given[key] for key in keys)):
            chosen = {key: name for key, name in zip(keys, row, strict=True) if name}
            config = compose(program, [f"{key}={name}" for key, name in chosen.items()])
            for key in chosen:
                group, _, package = key.partition("@")
                path = (package or group.replace("/", ".")).split(".")
                _build_all(group, reduce(getitem, path, config))


def _build_all(kind: str, node: object) -> None:
    if kind in KINDS and node.get("plugin"):  # null: none of the kind
        needed = {key: NEEDED[key] for key, value in node.items() if value == "???"}
        build(kind, node | needed, **{key: GIVEN[key] for key in PROVIDED.get(kind, ())})


@pytest.mark.parametrize("path", sorted(CONF.rglob("*.yaml")), ids=lambda p: p.stem)
def test_every_file_says_what_it_is(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert "# " in text and yaml.safe_load(text) is not None, f"{path.name} has no comment"


@pytest.mark.slow
def test_bundles_share_the_settings_of_their_stages() -> None:
    """`meshing.size` reaches every stage that has it as an option, in every bundle."""
    overrides = ["size=3%", "max_hexes=7", "deviation=1%", "curvature=2%", "level=3"]
    for bundle in options_of(loader(), "meshing"):
        found = compose("infer", [f"meshing={bundle}", *(f"meshing.{word}" for word in overrides)])
        stage = found["meshing"]["subdivide"]
        assert [stage[w.partition("=")[0]] for w in overrides if "dev" not in w] == [
            "3%",
            7,
            "2%",
            3,
        ]
        assert (
            found["meshing"]["refine"] | {"deviation": "1%", "max_hexes": 7}
            == (found["meshing"]["refine"])
        )


def test_settings_of_a_run_reach_the_options_that_follow_them() -> None:
    found = compose("infer", ["structure=diffusion", "seed=7", "ckpt=a.ckpt"])["structure"]
    assert (found["seed"], found["weights"]) == (7, "a.ckpt")
    held = compose("infer", ["analysis.fixed=[x_min]"])["spline"]["held"]
    assert held == ["x_min"]


def test_defaults_are_what_a_class_says() -> None:
    cls = classes()["meshing/subdivide", "template"]
    size = options("meshing/subdivide", cls)["size"]
    assert default(size) == compose("infer")["meshing"]["size"] == "5%"


@pytest.mark.slow
def test_there_is_something_to_test() -> None:
    n_choices = sum(len(names) for program in PROGRAMS for names in choices(program).values())
    assert len(PLUGINS) > 40 and n_choices > 40
