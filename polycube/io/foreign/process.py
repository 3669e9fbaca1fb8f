"""Let a library read a file in a process of its own, which may crash, loop or want all memory."""

from __future__ import annotations

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

SECONDS = 25  # of a processor that reading may take, and 30 more for each MB
PATIENCE = 5  # times as long by the clock, for a machine that is busy
MEMORY = 4  # GB of addresses that it may use, and 0.2 more for each MB
PARSERS = "polycube.io.foreign.parsers"


def read_alone(
    worker: str, path: Path, asked: Mapping[str, object], effort: float = 1.0
) -> tuple[bytes | None, str]:
    """Let a module look at a file in a process of its own.

    Parameters
    ----------
    worker : module that reads a request, as JSON, from its standard input, obeys its `limit`s and
        writes to its `output`
    asked : what the request has beside `path`, `output`, `seconds` and `gigabytes`
    effort : times as many seconds as usual

    Returns
    -------
    What it wrote, None where it did not, and its standard error.

    Raises
    ------
    InputError : it did not come to an end
    OSError
        If the file cannot be opened.
    """
    path.open("rb").close()
    megabytes = path.stat().st_size / 1e6
    seconds = ceil(SECONDS * effort + 30 * megabytes)
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "output"
        request = {
            "path": str(path),
            "output": str(output),
            "seconds": seconds,
            "gigabytes": MEMORY + megabytes / 5,
        }
        try:
            done = subprocess.run(
                [sys.executable, "-m", worker],
                input=json.dumps({**request, **asked}),
                capture_output=True,
                text=True,
                errors="replace",
                timeout=PATIENCE * seconds,
            )
        except subprocess.TimeoutExpired:
            raise _late(seconds) from None
        if resource is not None and done.returncode == -signal.SIGXCPU:
            raise _late(seconds)
        return (output.read_bytes() if output.is_file() else None), done.stderr


def _late(seconds: int) -> InputError:
    return InputError(
        f"reading it did not finish in {seconds} s; the file is damaged or incomplete"
    )


def limit(request: Mapping[str, Any]) -> None:
    """Limit this process to the `seconds` and `gigabytes` of its request."""
    if resource is None:
        return
    for kind, most in (
        (resource.RLIMIT_AS, int(1e9 * request["gigabytes"])),
        (resource.RLIMIT_CPU, int(request["seconds"])),
        (resource.RLIMIT_CORE, 0),
    ):
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(
            kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
        )


def parsed(path: Path, library: str) -> dict[str, np.ndarray]:
    """The arrays that a library of `parsers` finds in a file; raises InputError."""
    output, said = read_alone(PARSERS, path, {"library": library})
    if output is None:
        raise unreadable(path, said)
    with np.load(BytesIO(output), allow_pickle=False) as arrays:
        return dict(arrays)


def unreadable(path: Path, said: str) -> InputError:
    """Of a file that could not be read, with the last line that the process said."""
    lines = [line for line in said.strip().splitlines() if line.strip()]
    last = lines[-1].removeprefix("Exception: ") if lines else "its reader ended without a word"
    return InputError(f"not a readable {path.suffix} file: {brief(last)}")
