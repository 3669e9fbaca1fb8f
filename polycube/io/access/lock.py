"""One run at a time in a folder of results."""

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import strftime

from polycube.errors import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

NAME = ".polycube-lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other runs out of a folder, which is made if it does not exist.

    The lock ends with the process, also if it is killed. A folder that cannot be written or locked
    is not locked; a new folder that is still empty at the end is removed. Raises InputError if
    another run has the folder; it names the process, the machine and the time.
    """
    made = [each for each in (folder, *folder.parents) if not each.exists()]
    file = _taken(folder) if fcntl is not None else None
    try:
        yield
    finally:
        if file is not None:
            with suppress(OSError):
                (folder / NAME).unlink()
            os.close(file)
        with suppress(OSError):
            for each in made:
                each.rmdir()


def _taken(folder: Path) -> int | None:
    """Descriptor of the locked file."""
    path = folder / NAME
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
        except OSError:  # the first result that is written has the reason
            return None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.exists() and os.path.samestat(os.fstat(file), path.stat()):
                os.truncate(file, 0)
                start = f"process {os.getpid()} on {platform.node()}, since {strftime('%F %T')}"
                os.write(file, start.encode())
                return file
        except BlockingIOError:
            other = os.read(file, 500).decode(errors="replace") or "another process"
            os.close(file)
            remedy = f"wait for {other}, or choose another output_dir"
            raise InputError("another run writes its results there", str(folder), remedy) from None
        except OSError:  # no locks on this file system, or a full disk
            os.close(file)
            return None
        os.close(file)  # of a run that has just ended
