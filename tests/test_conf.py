"""conf/ and plugins/ agree: every YAML builds its plugin, every plugin has a YAML."""

from dataclasses import fields
from functools import cache
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from polycube.kinds import KINDS
from polycube.registry import build, names

CONF = Path(__file__).parents[1] / "conf"
PLUGINS = [(kind, name) for kind in KINDS for name in names(kind)]
FILES = [(kind, path) for kind in KINDS for path in sorted((CONF / kind).glob("*.yaml"))]

# what a run gives besides the options of the YAML, and what `???` stands for there
RUN = {"structure": {"grid": (2, 1, 1), "primitives": {}}}
ASKED = {"context": ["cube"]}


@cache
def options(kind: str, name: str) -> dict[str, object]:
    """The YAML as a run sees it, its own defaults composed in."""
    with initialize_config_dir(str(CONF), version_base="1.3"):
        config = compose(f"{kind}/{name}")
    found = OmegaConf.to_container(OmegaConf.select(config, kind.replace("/", ".")), resolve=True)
    found = found.get(name, found)  # of some kinds, such as export, a run takes several
    return {key: ASKED[key] if value == "???" else value for key, value in found.items()}


@pytest.mark.parametrize(("kind", "name"), PLUGINS, ids=map("=".join, PLUGINS))
def test_every_plugin_has_a_yaml_of_its_name(kind: str, name: str) -> None:
    path = CONF / kind / f"{name}.yaml"
    assert path.is_file(), f"{kind} plugin {name!r} needs conf/{kind}/{name}.yaml"
    assert options(kind, name)["plugin"] == name


@pytest.mark.parametrize(("kind", "path"), FILES, ids=lambda v: getattr(v, "stem", v))
def test_every_yaml_builds(kind: str, path: Path) -> None:
    config = options(kind, path.stem)
    if "plugin" in config:
        plugin = build(kind, config, **RUN.get(kind, {}))
        left_out = {field.name for field in fields(plugin)} - set(config)
        assert not left_out - set(RUN.get(kind, {})), f"{path.name} does not show {left_out}"
    else:
        assert config, f"{path} names neither a plugin nor what it is composed of"


@pytest.mark.parametrize("path", sorted(CONF.rglob("*.yaml")), ids=lambda p: p.stem)
def test_every_option_has_a_comment(path: Path) -> None:
    """One per key of a plugin's options; a heading line explains the plugin itself."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if not any(line.startswith("plugin:") for line in lines):
        return
    bare = [
        line
        for line in lines
        if line[:1].isalpha()
        and not line.startswith("plugin:")
        and line[-1] != ":"
        and "#" not in line
    ]
    assert not bare, f"{path.name}: no comment at {bare}"


@pytest.mark.parametrize("sampler", names("sampler"))
def test_a_structure_takes_any_sampler(sampler: str) -> None:
    with initialize_config_dir(str(CONF), version_base="1.3"):
        config = compose("structure/diffusion", [f"sampler@structure.sampler={sampler}"])
    chosen = OmegaConf.to_container(config.structure.sampler, resolve=True)
    assert chosen["plugin"] == sampler
    build("sampler", chosen)


def test_there_is_something_to_test() -> None:
    assert len(PLUGINS) > 15 and len(FILES) >= len(PLUGINS)
