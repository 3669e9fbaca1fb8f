"""Arguments of a command line, as Hydra's grammar reads them."""

from __future__ import annotations

from os.path import isfile  # unlike Path.is_file, it bears names that are too long

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException

PATHS = ("mesh", "hex", "output_dir", "resume", "ckpt", "begin_from", "data.path")


def with_mesh(arguments: list[str]) -> list[str]:
    """Read the only argument that is the name of an existing file as the value of `mesh=`.

    Parameters
    ----------
    arguments : of the command line, without the program's name

    Returns
    -------
    All arguments; unchanged where none or several are files, or where an input is named already.
    """
    bare = [word for word in arguments if not word.startswith("-") and isfile(word)]
    if len(bare) != 1 or any(word.startswith(("mesh=", "hex=", "resume=")) for word in arguments):
        return arguments
    return [f"mesh={word}" if word == bare[0] else word for word in arguments]


def quoted(arguments: list[str]) -> list[str]:
    """The arguments; paths that Hydra's grammar cannot read, as with # or =, in quotes."""
    return [_quoted(word) if word.partition("=")[0] in PATHS else word for word in arguments]


def _quoted(word: str) -> str:
    try:
        OverridesParser.create().parse_overrides([word])
    except HydraException:
        name, _, path = word.partition("=")
        return f"{name}={quote(path)}"
    return word


def quote(path: str) -> str:
    """A path in quotes."""
    return "'" + path.replace("\\", "\\\\").replace("'", "\\'") + "'"
