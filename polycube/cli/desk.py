"""Open a local page at which a person sets up, starts and compares runs."""

import secrets
import socket
import sys
import webbrowser
from argparse import ArgumentParser
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from polycube.cli.command import refusing
from polycube.errors import InputError

HOST = "127.0.0.1"  # no other machine can reach it


def main(arguments: Sequence[str] | None = None) -> None:
    """Serve the desk of a command line until Ctrl-C."""
    parser = ArgumentParser(prog="polycube-desk", description=__doc__)
    about = "a part, or a folder with parts"
    parser.add_argument("part", nargs="?", type=Path, default=Path(), help=about)
    about = "port of the page (default: a free one)"
    parser.add_argument("--port", type=int, default=0, help=about)
    parser.add_argument("--no-browser", action="store_true", help="do not open the page")
    given = parser.parse_args(arguments)
    with refusing():
        if find_spec("nicegui") is None:
            raise InputError("NiceGUI is not installed", "", "pip install 'polycube[desk]'")
        if not given.part.exists():
            raise InputError("there is no such file or folder", str(given.part))
        port = free_port(given.port)
    serve(given.part.resolve(), port, not given.no_browser)


def free_port(wanted: int) -> int:
    """A port that can be used: the wanted one, or any for 0; raises InputError."""
    with socket.socket() as one:
        try:
            one.bind((HOST, wanted))
        except (OSError, OverflowError) as error:
            remedy = "name another port, or none"
            raise InputError(f"it cannot be used: {error}", f"--port {wanted}", remedy) from None
        return int(one.getsockname()[1])


def serve(part: Path, port: int, opens: bool) -> None:
    """Serve the page for a part, or for a folder, on this machine only."""
    from nicegui import app, ui

    from polycube.cli.process import RESULTS
    from polycube.desk import part as part_view
    from polycube.desk import results
    from polycube.desk.access import OnlyWithToken
    from polycube.desk.job import Job
    from polycube.desk.page import Desk

    folder = part if part.is_dir() else part.parent
    token = secrets.token_urlsafe(16)
    address = f"http://{HOST}:{port}/?token={token}"
    (folder / RESULTS).mkdir(exist_ok=True)
    app.add_static_files(results.ADDRESS, folder / RESULTS, max_cache_age=0)
    app.add_middleware(OnlyWithToken, token=token)
    sys.stdout.write(f"{address}\n")
    sys.stdout.flush()
    if opens:
        app.on_startup(lambda: webbrowser.open(address))
    with suppress(KeyboardInterrupt), TemporaryDirectory() as scratch:
        app.add_static_files(part_view.ADDRESS, scratch)
        job = Job(part="" if part.is_dir() else part.name)
        ui.page("/")(Desk(folder, Path(scratch), job).build)
        ui.run(host=HOST, port=port, show=False, reload=False, show_welcome_message=False)
