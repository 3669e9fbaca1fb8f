"""What `--help` lists: the options of all groups with a line each, settings with their comments.

Both are read from the YAML files on Hydra's search path, so a stranger's options are listed too.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import dropwhile, takewhile
from pathlib import Path
from textwrap import shorten

from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from polycube import HOME

WIDTH = 100  # of a line on the terminal


def listed(*others: str) -> str:
    """All groups but the others, each with its options below, aligned, and what each option is."""
    lines = []
    for group in _groups():
        options = GlobalHydra.instance().config_loader().get_group_options(group)
        if not options or group.partition("/")[0] in others:
            continue
        lines.append(group)
        longest = max(map(len, options))
        told = [shorten(_what(group, o), WIDTH - longest, placeholder=" …") for o in options]
        lines += [f"  {o:{longest}}  {what}" for o, what in zip(options, told, strict=True)]
    return "\n".join(lines)


def settings(name: str) -> str:
    """The settings of conf/`name`.yaml outside of its groups, with their comments."""
    lines = (HOME / "conf" / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
    own = dropwhile(lambda line: not re.match(r"(?!defaults)\w", line), lines)
    return "\n".join(takewhile(lambda line: not line.startswith("hydra:"), own)).strip()


def _groups(parent: str = "") -> Iterator[str]:
    """All groups below one, each before those inside of it."""
    for name in GlobalHydra.instance().config_loader().list_groups(parent):
        if name != "hydra":
            group = f"{parent}/{name}".lstrip("/")
            yield group
            yield from _groups(group)


def _what(group: str, option: str) -> str:
    """The first line of an option's file that says what it is; empty where there is no file."""
    for folder in _folders():
        path = folder / group / f"{option}.yaml"
        if path.is_file():
            lines = path.read_text(encoding="utf-8").splitlines()
            first = next(line for line in lines if line and not line.startswith("# @package"))
            return re.sub(r"^(plugin: \S+ *)?# *", "", first)
    return ""


def _folders() -> list[Path]:
    """Of configuration files, ours and those of plugin packages."""
    search = GlobalHydra.instance().config_loader().get_search_path().get_path()
    places = [entry.path for entry in search if entry.path and not entry.path.startswith("pkg://")]
    return [Path(place.removeprefix("file://")) for place in places]


OmegaConf.register_new_resolver("choices", listed)
OmegaConf.register_new_resolver("settings", settings)
