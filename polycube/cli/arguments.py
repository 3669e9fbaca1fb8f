"""Arguments of a command line in the grammar of Hydra."""

from argparse import Namespace
from os.path import (  # unlike those of Path, they accept names that are too long
    isdir,
    isfile,
    lexists,
)

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException

from polycube.config import SHORT, quote

PATHS = ("mesh", "hex", "output_dir", "resume", "ckpt", "begin_from", "data.path")


def split(arguments: list[str]) -> tuple[Namespace, list[str]]:
    """The flags of Hydra and the `overrides` of a command line, and its unknown flags.

    Parameters
    ----------
    arguments : of the command line, without the name of the program
    """
    return get_args_parser().parse_known_args(arguments)


def with_input(arguments: list[str]) -> list[str]:
    """Read the only argument that is the name of a part as the value of `mesh=` or `hex=`.

    Parameters
    ----------
    arguments : of the command line, without the name of the program

    Returns
    -------
    All arguments. A file, a folder, a pattern, `example:NAME` and a name with the suffix of a part
    get the prefix `mesh=`, a hex mesh gets `hex=`. The arguments are unchanged if there are several
    such names, or if an input is given already.
    """
    from polycube.io.hex_meshes import FORMATS
    from polycube.io.surfaces import KNOWN

    overrides = split(arguments)[0].overrides
    bare = [each for each in overrides if _is_part(each, (*KNOWN, *FORMATS))]
    if len(bare) != 1:
        return arguments
    key = "hex=" if bare[0].lower().endswith(FORMATS) else "mesh="
    if any(each.startswith(key) for each in overrides):
        return arguments
    place = arguments.index(bare[0])
    value = quote(bare[0]) if "${" in bare[0] else bare[0]
    return [*arguments[:place], key + value, *arguments[place + 1 :]]


def _is_part(argument: str, suffixes: tuple[str, ...]) -> bool:
    if isfile(argument):
        return True
    named = argument.startswith("example:") or argument.lower().endswith(suffixes)
    return "=" not in argument and (
        named or isdir(argument) or any(sign in argument for sign in "*?")
    )


def in_full(arguments: list[str]) -> list[str]:
    """All arguments, with the full names of options for short ones such as `size=3`."""
    found = []
    for argument in arguments:
        name, sign, value = argument.partition("=")
        found.append(f"{SHORT.get(name, name)}={value}" if sign else argument)
    return found


def quoted(arguments: list[str]) -> list[str]:
    """The arguments, with quotes around paths that Hydra cannot read literally, as with # or ${."""
    return [
        _quoted(argument) if argument.partition("=")[0] in PATHS else argument
        for argument in arguments
    ]


def _quoted(argument: str) -> str:
    name, _, path = argument.partition("=")
    if "${" in path and lexists(path):
        return f"{name}={quote(path)}"
    try:
        OverridesParser.create().parse_overrides([argument])
    except HydraException:
        return f"{name}={quote(path)}"
    return argument
