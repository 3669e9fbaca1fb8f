"""Run the reader of another library in a separate process with limits of time and memory."""

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from io import BytesIO
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from polycube.errors import InputError, brief

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

SECONDS = 25  # limit of processor time; each MB of the file adds 30 s
PATIENCE = 5  # limit of elapsed time, as a multiple of the processor time
MEMORY = 4  # limit of address space in GB; each MB of the file adds 0.2 GB
PARSERS = "polycube.io.foreign.parsers"


class Late(InputError):
    """A reader did not finish in time.

    seconds : limit
    errors : standard error of its process
    """

    def __init__(self, seconds: int, errors: str) -> None:
        self.seconds, self.errors = seconds, errors
        what = f"reading it did not finish in {seconds} s"
        super().__init__(f"{what}; the file is damaged or incomplete")


def read_separately(
    worker: str, path: Path, options: Mapping[str, object], effort: float = 1.0
) -> tuple[bytes | None, str]:
    """Run a module that reads a file, in a separate process.

    Returns what the module wrote, None if it wrote nothing or failed, and its standard error.
    Raises Late at the time limit, and OSError if the file cannot be opened.

    worker : name of the module. It reads a request, as JSON, from its standard input, calls `limit`
        and writes to `output`.
    options : content of the request in addition to `path`, `output`, `seconds` and `gigabytes`
    effort : factor of the time limit
    """
    path.open("rb").close()
    megabytes = path.stat().st_size / 1e6
    seconds = ceil(SECONDS * effort + 30 * megabytes)
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "output"
        request = {"path": str(path), "output": str(output), **options}
        request |= {"seconds": seconds, "gigabytes": MEMORY + megabytes / 5}
        try:
            done = subprocess.run(
                [sys.executable, "-m", worker],
                input=json.dumps(request),
                capture_output=True,
                text=True,
                errors="replace",
                timeout=PATIENCE * seconds,
            )
        except subprocess.TimeoutExpired as error:
            raise Late(seconds, (error.stderr or b"").decode(errors="replace")) from None
        if resource is not None and done.returncode == -signal.SIGXCPU:
            raise Late(seconds, done.stderr)
        is_written = done.returncode == 0 and output.is_file()
        return (output.read_bytes() if is_written else None), done.stderr


def limit(request: Mapping[str, Any]) -> None:
    """Set the limits `seconds` and `gigabytes` of a request for this process."""
    if resource is None:
        return
    for kind, most in (
        (resource.RLIMIT_AS, int(1e9 * request["gigabytes"])),
        (resource.RLIMIT_CPU, int(request["seconds"])),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        soft = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (soft, hard))


def parsed(path: Path, library: str) -> dict[str, np.ndarray]:
    """Arrays that a library of `parsers` reads from a file.

    Raises InputError if the library cannot read the file or does not finish in time.
    """
    output, errors = read_separately(PARSERS, path, {"library": library})
    if output is None:
        raise unreadable(path, errors)
    return dict(np.load(BytesIO(output), allow_pickle=False))


def unreadable(path: Path, errors: str) -> InputError:
    """Error for a file that could not be read, with the last line of the standard error."""
    lines = [line for line in errors.strip().splitlines() if line.strip()]
    last = lines[-1].removeprefix("Exception: ") if lines else "its reader crashed"
    return InputError(f"not a readable {path.suffix} file: {brief(last)}")
