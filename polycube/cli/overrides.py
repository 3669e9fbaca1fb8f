"""What is wrong with a command line, in one sentence, with the nearest name that would be right."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches

from hydra import compose, initialize_config_dir
from hydra._internal.utils import get_args_parser
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from polycube import HOME
from polycube.errors import InputError

PATHS = ("mesh", "hex", "output_dir", "resume", "ckpt", "begin_from")


@contextmanager
def plain_refusals(config_name: str) -> Iterator[None]:
    """Around a function of `hydra.main`: InputError, one sentence, for a wrong command line."""
    arguments = sys.argv[1:] = quoted(sys.argv[1:])
    os.environ["HYDRA_FULL_ERROR"] = "1"  # else Hydra prints several lines and ends the program
    for word in get_args_parser().parse_known_args(arguments)[1]:
        if word.startswith("-"):
            name = word.lstrip("-").partition("=")[0]
            raise InputError(f"unknown flag {word}; options are given as {name}=value")
    try:
        yield
    except HydraException as error:
        raise InputError(sentence(error, config_name, arguments)) from None


def quoted(arguments: list[str]) -> list[str]:
    """The arguments; paths that Hydra's grammar can not read, as with # or =, in quotes."""
    return [_quoted(word) if word.partition("=")[0] in PATHS else word for word in arguments]


def _quoted(word: str) -> str:
    try:
        OverridesParser.create().parse_overrides([word])
    except HydraException:
        name, _, path = word.partition("=")
        return f"{name}={quote(path)}"
    return word


def quote(path: str) -> str:
    """A path as Hydra's grammar reads any."""
    return "'" + path.replace("\\", "\\\\").replace("'", "\\'") + "'"


def sentence(error: Exception, config_name: str, arguments: list[str]) -> str:
    """Of an error that Hydra or OmegaConf raised when it composed `config_name`."""
    if isinstance(error, MissingConfigException) and "/" in str(error.missing_cfg_file):
        return _no_choice(error)
    if isinstance(error, OverrideParseException):
        wrong = str(error).splitlines()[0] if "=" in error.override else "it has no ="
        return f"{error.override!r} can not be read: {wrong}; write name=value, lists as 'a=[1,2]'"
    if "is not in struct" not in str(error.__cause__):
        return " ".join(str(error.__cause__ or error).split())
    key = error.__cause__.full_key
    known = list(_names(_composed(config_name, arguments)))
    parent = key.rpartition(".")[0]
    beside = [name for name in known if name.rpartition(".")[0] == parent != ""]
    near = _near(key, beside) or _near(key, known, same_end=True)
    have = f"; {parent} has {', '.join(n.rpartition('.')[2] for n in beside)}" if beside else ""
    return f"there is no option {key}{near}{have or '; --help lists them'}"


def _no_choice(error: MissingConfigException) -> str:
    group, _, name = str(error.missing_cfg_file).rpartition("/")
    of_lists = (path.stem for path in (HOME / "conf" / group).glob("*.yaml"))  # Hydra has none
    options = sorted(error.options or of_lists)
    return (
        f"{group}={name}: there is no such choice{_near(name, options)}; have {', '.join(options)}"
    )


def _near(name: str, known: list[str], same_end: bool = False) -> str:
    """The nearest known name; with `same_end` rather meshing.size for size."""
    ends = [k for k in known if same_end and k.rpartition(".")[2] == name.rpartition(".")[2]]
    found = get_close_matches(name, ends, 1, 0.0) or get_close_matches(name, known, 1, 0.5)
    return f", did you mean {found[0]}" if found else ""


def _composed(config_name: str, arguments: list[str]) -> Mapping[str, object]:
    """The config as the choices of groups alone make it, or without any."""
    parser, groups = OverridesParser.create(), []
    for word in arguments:
        try:
            [override] = parser.parse_overrides([word])
        except HydraException:
            continue
        if (HOME / "conf" / override.key_or_group.partition("@")[0]).is_dir():
            groups.append(word)
    for chosen in (groups, []):
        GlobalHydra.instance().clear()
        try:
            with initialize_config_dir(str(HOME / "conf"), version_base="1.3"):
                return OmegaConf.to_container(compose(config_name, chosen))
        except (HydraException, OmegaConfBaseException):
            continue
    return {}


def _names(config: Mapping[str, object], before: str = "") -> Iterator[str]:
    """Full names of all options, and of the groups they are in."""
    for key, value in config.items():
        yield f"{before}{key}"
        if isinstance(value, Mapping):
            yield from _names(value, f"{before}{key}.")
