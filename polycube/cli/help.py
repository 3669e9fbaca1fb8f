"""`--help`: how to begin, the choices, and the options of a choice.

The sources are those of a run: the YAML files and the plugin classes on the search path, including
those of installed plugin packages.
"""

import inspect
import json
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from textwrap import indent, shorten, wrap

from hydra.core.config_loader import ConfigLoader
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.types import RunMode
from omegaconf import OmegaConf

from polycube import HOME
from polycube.cli.command import split
from polycube.config import SEVERAL, SHARED, by_name, compose, loader, options_of
from polycube.registry import classes, default, names, options

WIDTH = 100  # width of a line in the terminal
MORE = "All options of a choice: --help GROUP=OPTION.  All values: --cfg job."
PARAMETER = re.compile(r"^(\w+(?:, \w+)*) : (.*(?:\n    .*)*)", re.MULTILINE)


def shown(config_name: str, arguments: list[str]) -> bool:
    """Print the help of a program, or of the choices among its arguments, if it is requested."""
    given = split(arguments)[0]
    if not given.help:
        return False
    blocks = list(of_choices(config_name, given.overrides)) if given.overrides else []
    if not blocks:
        own = OmegaConf.load(HOME / "conf" / f"{config_name}.yaml")
        texts = OmegaConf.select(own, "hydra.help")
        blocks = [
            texts.header,
            f"== Choices: group=option (* default) ==\n{choices(config_name)}",
            f"== Settings: name=value ==\n{settings(config_name)}",
            f"{texts.footer}{MORE}",
        ]
    sys.stdout.write("\n\n".join(block.strip() for block in blocks) + "\n")
    return True


def choices(config_name: str) -> str:
    """All groups of a command line, with a line for each choice."""
    search = loader()
    defaults = search.compute_defaults_list(config_name, [], RunMode.RUN).overrides.known_choices
    chosen = {key: name for key, name in defaults.items() if not key.startswith("hydra/")}
    chosen |= dict.fromkeys(SEVERAL if config_name == "infer" else ())
    lines = []
    for key in sorted(chosen):
        group, _, package = key.partition("@")
        if package and group in chosen:
            lines.append(f"{key}: default {chosen[key]}")
            continue
        found = options_of(search, group)
        rows = [(f"{' *'[n == chosen[key]]} {n}", summary(search, group, n)) for n in found]
        lines += [key, *_aligned(rows)]
    if "primitives" in chosen:
        rows = [(f"  {name}", summary(search, "primitive", name)) for name in names("primitive")]
        lines += ["names for primitives.use=[...] and context=[...]", *_aligned(rows)]
    return "\n".join(lines)


def settings(name: str) -> str:
    """The settings of conf/`name`.yaml outside of its groups, with their comments."""
    text = (HOME / "conf" / f"{name}.yaml").read_text(encoding="utf-8")
    return str(re.findall(r"(?ms)^(?!defaults)\w.*?(?=^hydra:)", text)[0]).strip()


def of_choices(config_name: str, overrides: Sequence[str]) -> Iterator[str]:
    """Options, values and help of the choices among the overrides, and of their parts."""
    values = dict(by_name(compose(config_name, overrides)))
    given = OverridesParser.create().parse_overrides(list(overrides))
    chosen = tuple(f"{each.package or each.key_or_group.replace('/', '.')}." for each in given)
    plugins = {"/".join(key): (key[0], cls) for key, cls in {**SHARED, **classes()}.items()}
    for part in loader().compute_defaults_list(config_name, list(overrides), RunMode.RUN).defaults:
        if part.config_path in plugins and f"{part.package}.".startswith(chosen):
            kind, cls = plugins[part.config_path]
            lines = [f"== {part.package}: {_first_line(cls)} =="]
            for name, text in described(kind, cls).items():
                value = values[f"{part.package}.{name}"]
                written = value if isinstance(value, str) else json.dumps(value)
                about = indent("\n".join(wrap(text, WIDTH - 4)), "    ")
                lines += [f"{part.package}.{name}={written}", about]
            yield "\n".join(lines)


def summary(search: ConfigLoader, group: str, name: str) -> str:
    """Description of a choice of a group in one line; empty if there is none."""
    cls = classes().get((group, name))
    if cls is not None:
        return _first_line(cls)
    paths = (Path(source.path, group, f"{name}.yaml") for source in search.get_sources())
    texts = (path.read_text(encoding="utf-8") for path in paths if path.is_file())
    found = re.search("# (.*)", next(texts, ""))
    return found[1] if found else ""


def described(kind: str, cls: type) -> dict[str, str]:
    """Help of the options of a plugin class, including nested options."""
    texts = documented(cls)
    found: dict[str, str] = {}
    for name, option in options(kind, cls).items():
        value = default(option)
        if is_dataclass(value):
            inner = documented(type(value))
            found |= {f"{name}.{f.name}": inner.get(f.name, "") for f in fields(value)}
        else:
            found[name] = texts.get(name, "")
    return found


def documented(cls: type) -> dict[str, str]:
    """The `Parameters` sections of a class and its base classes, by name."""
    texts: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        section = inspect.cleandoc(base.__doc__ or "").partition("Parameters\n----------\n")[2]
        for match in PARAMETER.finditer(section.partition("\n\n")[0]):
            texts |= dict.fromkeys(match[1].split(", "), " ".join(match[2].split()))
    return texts


def _first_line(cls: type) -> str:
    return (cls.__doc__ or "").partition("\n")[0].removesuffix(".")


def _aligned(rows: Sequence[tuple[str, str]]) -> list[str]:
    longest = max((len(name) for name, _ in rows), default=0)
    short = partial(shorten, width=WIDTH - longest - 2, placeholder=" …")
    return [f"{name:{longest}}  {short(text)}".rstrip() for name, text in rows]
