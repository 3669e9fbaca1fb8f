"""What is wrong with a command line, in one sentence, with the nearest name that would be right."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException

from polycube.config import refusal
from polycube.errors import InputError

PATHS = ("mesh", "hex", "output_dir", "resume", "ckpt", "begin_from")


@contextmanager
def plain_refusals() -> Iterator[None]:
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
        raise refusal(error) from None


def with_mesh(arguments: list[str]) -> list[str]:
    """Read the only argument that is the name of an existing file as the value of `mesh=`.

    Parameters
    ----------
    arguments : of the command line, without the program's name

    Returns
    -------
    All arguments; unchanged where none or several are files, or where an input is named already.
    """
    bare = [word for word in arguments if not word.startswith("-") and Path(word).is_file()]
    if len(bare) != 1 or any(word.startswith(("mesh=", "hex=", "resume=")) for word in arguments):
        return arguments
    return [f"mesh={word}" if word == bare[0] else word for word in arguments]


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
