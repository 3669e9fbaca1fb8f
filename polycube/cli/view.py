"""Show the 3D views of several results on one page, which is opened in the browser."""

import sys
import webbrowser
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from pathlib import Path

from polycube.cli.command import refusing
from polycube.errors import InputError
from polycube.io import manifest
from polycube.report.page.views.comparison import PAGE, comparison_page

MOST = 12  # largest number of results: browsers draw 16 views on a page at most
REPORT = "report.html"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page of the results in the folders of a command line, and open it."""
    parser = ArgumentParser(prog="polycube-view", description=__doc__)
    parser.add_argument(
        "folder", nargs="+", type=Path, help="results of a run, or a folder that contains results"
    )
    parser.add_argument(
        "--output", type=Path, help="file of the page (default: view.html in the folder)"
    )
    parser.add_argument("--no-browser", action="store_true", help="do not open the page")
    given = parser.parse_args(arguments)
    with refusing():
        page = write_view(given.folder, given.output)
    sys.stdout.write(f"{page}\n")
    if not given.no_browser:
        webbrowser.open(page.resolve().as_uri())


def write_view(folders: Sequence[Path], output: Path | None = None) -> Path:
    """Write the page of all results in some folders.

    Parameters
    ----------
    folders : results of runs, or folders that contain results
    output : file of the page; None: `view.html`, in the folder if there is only one, otherwise in
        the current folder

    Raises
    ------
    InputError
        If a folder contains no results, if there are too many of them, or if the page would
        overwrite a file of the user.
    """
    each = (result for folder in folders for result in results_in(folder))
    found = list({result.resolve(): result for result in each}.values())
    if len(found) > MOST:
        raise InputError(f"{len(found)} results are too many for a page; name at most {MOST}")
    path = output or (folders[0] if len(folders) == 1 else Path()) / PAGE
    text = comparison_page(found, path.parent)
    with manifest.writing(path.parent, "choose another --output") as scratch:
        (scratch / path.name).write_text(text, encoding="utf-8")
    return path


def results_in(folder: Path) -> Iterable[Path]:
    """The folders of results in a folder: itself, or those below it.

    Raises
    ------
    InputError
        If there are none.
    """
    if not folder.is_dir():
        raise InputError("there is no such folder", str(folder))
    if (folder / REPORT).is_file():
        return [folder]
    found = sorted(path.parent for path in folder.rglob(REPORT))
    if not found:
        raise InputError(f"it contains no {REPORT}; name the output_dir of a run", str(folder))
    return found
