"""Read a file of the user: only regular files are opened, and errors begin with its name."""

import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from polycube.errors import InputError, brief
from polycube.types import Json

LARGE = 1 << 26  # bytes from which files with holes are refused
BLOCK = 512  # bytes of a unit of `st_blocks`


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Check a file before the block that reads it, and name it in the errors of the block.

    Raises InputError if it is not a regular file, if it has holes, or if the block raises
    InputError, OSError or RecursionError.
    """
    try:
        if os.path.exists(path):
            _check_regular(path)
        yield
    except InputError as error:
        raise InputError(f"{path}: {error}") from error.__cause__
    except RecursionError:
        raise InputError(f"{path}: its entries refer to each other without end") from None
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def _check_regular(path: Path) -> None:
    found = path.stat()
    if stat.S_ISDIR(found.st_mode):
        raise InputError("this is a folder; give one file")
    if not stat.S_ISREG(found.st_mode):
        raise InputError("this is a pipe, a socket or a device; give a regular file")
    on_disk = BLOCK * getattr(found, "st_blocks", found.st_size)
    if found.st_size > max(LARGE, 100 * on_disk):
        what = f"only {on_disk} of its {found.st_size} bytes are on the disk, the others are a hole"
        raise InputError(what, remedy="copy the file again")


def read_json(path: Path, remedy: str = "name the folder of a run") -> Json:
    """Names and values of a JSON file of the program, which may have been edited since.

    Raises InputError if there is no such file, or if it is damaged.
    """
    if not path.is_file():
        raise InputError("there is no such file", str(path), remedy)
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"is damaged ({brief(error)})", str(path), remedy) from None
    if not isinstance(found, dict):
        raise InputError("is damaged: it has no names", str(path), remedy)
    return found
