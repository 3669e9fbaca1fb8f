"""The page of all options, from conf/*.yaml and the plugin classes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import Field

from hydra.types import RunMode

from docs.generators.reference.markdown import MADE, sentence, table
from polycube.cli.help import described, settings, summary
from polycube.config import SEVERAL, SHARED, loader, options_of
from polycube.kinds import KINDS
from polycube.registry import classes, default, options

PROGRAMS = {
    "infer": "python infer.py",
    "train": "python train.py",
    "evaluate": "python -m polycube.evaluate",
}
SETTING = re.compile(r"^( *)(\w+):(?: +([^#\s].*?))?(?: +# (.*))?$")
HEAD = """# Options

Every option is written as `name=value` on the command line; `group=choice` chooses a plugin or a
YAML file. In Python the same names are keyword arguments of `polycube.mesh` ([api.md](api.md)).
`--help` prints this list, `--help group=choice` the options of one choice, and `--cfg job` all
values of a run. Lists and mappings need quotes in a shell: `'analysis.fixed=[x_min]'`.

"""
HEADS = ("option", "default", "meaning")


def page() -> str:
    """The text of options.md."""
    blocks = [f"{HEAD}{MADE}"]
    for name, command in PROGRAMS.items():
        blocks += [f"## Settings of `{command}`", table(HEADS, list(_settings(name)))]
        heads = "group", "choices", "default"
        blocks += [f"Choices of `{command}`:", table(heads, list(_groups(name)))]
    shared = ("meshing", "_settings")
    blocks += ["## Options of plugins", "### meshing.*", _plugin("meshing", SHARED[shared])]
    for kind in KINDS:
        blocks += _kind(kind)
    return "\n\n".join(blocks) + "\n"


def _settings(program: str) -> Iterator[tuple[str, str, str]]:
    """Name, default and description of the settings of a program, from its YAML file."""
    path: list[str] = []
    for line in settings(program).splitlines():
        found = SETTING.match(line)
        if found is None:
            continue
        indent, name, value, text = found.groups()
        path = [*path[: len(indent) // 2], name]
        shown = "required" if value == "???" else f"`{value}`" if value else ""
        yield f"`{'.'.join(path)}`", shown, text or ""


def _groups(program: str) -> Iterator[tuple[str, str, str]]:
    """Groups of a program, the choices of each, and the default."""
    search = loader()
    defaults = search.compute_defaults_list(program, [], RunMode.RUN).overrides.known_choices
    for key, chosen in sorted(defaults.items()):
        names = [] if key.startswith("hydra/") else options_of(search, key.partition("@")[0])
        if names:
            yield f"`{key}`", _listed(names), "" if chosen is None else f"`{chosen}`"
    for kind in SEVERAL if program == "infer" else ():
        yield f"`{kind}`", _listed(options_of(search, kind)), "`[]`"


def _kind(kind: str) -> Iterator[str]:
    """Sections of the plugins of a kind with options; one table of those without."""
    plain = []
    yield f"### {kind}"
    yield sentence(KINDS[kind].protocol.__doc__ or "")
    for (of, name), cls in sorted(classes().items()):
        if of == kind and cls.__module__.startswith("polycube."):
            address = kind.replace("/", ".") + (f".{name}" if kind in SEVERAL else "")
            if options(kind, cls):
                yield f"#### {kind}={name}"
                yield f"{sentence(cls.__doc__ or '')}"
                yield _plugin(address, cls, kind)
            else:
                plain.append((f"`{name}`", summary(loader(), kind, name)))
    if plain:
        yield table(("without options", ""), plain)


def _plugin(address: str, cls: type, kind: str = "") -> str:
    """A table of the options of a class."""
    fields = options(kind, cls)
    rows = []
    for name, text in described(kind, cls).items():
        first, *inner = name.split(".")
        value = default(fields[first])
        shown = getattr(value, inner[0]) if inner else value
        rows.append((f"`{address}.{name}`", _default(fields[first], shown), text))
    return table(HEADS, rows)


def _default(option: Field, value: object) -> str:
    """A default as written on the command line, or the setting from which it is taken."""
    if "choice" in option.metadata:
        return f"`{option.metadata['choice'][1]}`"
    if "setting" in option.metadata and value != "???":
        source = option.metadata["setting"]
        return f"`{source}`" if value is None else f"`{source}`, else {_written(value)}"
    return "required" if value == "???" else _written(value)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _written(value: object) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return f"`{text}`"
