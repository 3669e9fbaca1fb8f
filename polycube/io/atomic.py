"""Atomic writing of files: written to a temporary file in the same folder, then moved."""

import os
import platform
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

SCRATCH = ".polycube-"  # begin of the names of scratch folders; process, random word, machine


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`, which becomes `path` at the end of the block.

    If the block raises, the previous file at `path` is unchanged and the temporary file is removed.
    """
    path = Path(path)
    temporary = path.with_name(f".{os.getpid()}-{path.name}")  # keeps the suffix
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_parts(path: Path, parts: Iterable[str]) -> Path:
    """Write a text, given in parts, atomically, and return its path."""
    with (
        atomic_write(path) as temporary,
        open(temporary, "w", encoding="utf-8", newline="\n") as file,
    ):
        file.writelines(parts)
    return Path(path)


@contextmanager
def scratch_folder(folder: Path) -> Iterator[Path]:
    """Yield a new folder in `folder` for files that are moved from there when they are complete.

    It is removed when the block ends, and those that killed processes of this machine left are
    removed at the begin.
    """
    machine = platform.node()
    name = re.compile(rf"{re.escape(SCRATCH)}(\d+)-\w+-{re.escape(machine)}")
    for left in folder.iterdir():
        found = name.fullmatch(left.name)
        if found and not _is_running(int(found[1])):
            shutil.rmtree(left, ignore_errors=True)
    prefix, suffix = f"{SCRATCH}{os.getpid()}-", f"-{machine}"
    with TemporaryDirectory(prefix=prefix, suffix=suffix, dir=folder) as scratch:
        yield Path(scratch)


def _is_running(process: int) -> bool:
    if os.name != "posix":  # elsewhere the signal 0 ends the process
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # of another user
        pass
    return True
