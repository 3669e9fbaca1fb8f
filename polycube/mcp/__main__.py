"""Offer the program as tools to other programs: the Model Context Protocol on stdin and stdout."""

from argparse import ArgumentParser
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from polycube.cli.command import refusing
from polycube.errors import InputError


def main(arguments: Sequence[str] | None = None) -> None:
    """Serve the folder of a command line until stdin is closed."""
    parser = ArgumentParser(prog="polycube-mcp", description=__doc__)
    about = "with the parts; nothing outside is read or written (default: the current folder)"
    parser.add_argument("folder", nargs="?", type=Path, default=Path(), help=about)
    folder = parser.parse_args(arguments).folder
    with refusing():
        if find_spec("mcp") is None:
            raise InputError("the package mcp is not installed", "", "pip install 'polycube[mcp]'")
        if not folder.is_dir():
            raise InputError("there is no such folder", str(folder))
    from polycube.mcp.server import Server

    with suppress(KeyboardInterrupt):
        Server(folder.resolve()).run()


if __name__ == "__main__":
    main()
