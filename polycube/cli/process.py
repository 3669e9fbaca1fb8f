"""A run of `infer.py` in a process of its own, and the results of earlier ones."""

import asyncio
import os
import shlex
import sys
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import NamedTuple

from polycube.cli.batch import part_name
from polycube.config import literal
from polycube.errors import InputError
from polycube.io.access.reading import read_json

PROGRAM = "from polycube.cli import infer_command; infer_command()"
RESULTS = "outputs"
COMMAND = "command.txt"


class Process:
    """A run that has begun.

    process : its process
    folder : where its results will be
    command : the command line that repeats it
    """

    def __init__(self, process: asyncio.subprocess.Process, folder: Path, command: str) -> None:
        self._process, self.folder, self._command = process, folder, command

    @classmethod
    async def begin(cls, folder: Path, part: str, settings: Sequence[str]) -> "Process":
        """Start a run of a part in a folder, with results in a new folder in it."""
        stamp = time.strftime("%Y-%m-%d-%H-%M-%S")
        results = folder / RESULTS / part_name(part) / stamp
        words = [*settings, f"output_dir={literal(str(results.relative_to(folder)))}"]
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-u", "-c", PROGRAM, *words),
            cwd=folder,
            env={**os.environ, "PYTHONSAFEPATH": "1"},  # no module of that folder is imported
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
        return cls(process, results, shlex.join(["polycube-infer", *settings]))

    @property
    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.returncode is None

    async def lines(self) -> AsyncIterator[str]:
        """What it prints, until it ends."""
        assert self._process.stdout is not None
        async for line in self._process.stdout:
            yield line.decode(errors="replace").rstrip()

    async def end(self) -> int:
        """Its exit code; its command line is written beside its results."""
        code = await self._process.wait()
        if self.folder.is_dir():
            (self.folder / COMMAND).write_text(f"{self._command}\n")
        return code

    def stop(self) -> None:
        """Ask it to end with the best mesh so far, like Ctrl-C."""
        if self.is_running:
            self._process.terminate()


class Earlier(NamedTuple):
    """A run with a report."""

    name: str  # part and time, the path of its results in `RESULTS`
    verdict: str
    hexes: int
    scaled_jacobian: float


def earlier(folder: Path) -> list[Earlier]:
    """The runs with a report in a folder, the last one first."""
    found = []
    for page in (folder / RESULTS).glob("*/*/report.html"):
        try:
            numbers = read_json(page.parent / "report.json")
        except InputError:  # it was changed or removed
            continue
        hexes = numbers.get("hex", {})
        name = page.parent.relative_to(folder / RESULTS).as_posix()
        values = hexes.get("hexes", 0), hexes.get("min_scaled_jacobian", float("nan"))
        found.append(Earlier(name, "valid" if numbers["valid"] else "not valid", *values))
    return sorted(found, key=lambda each: each.name.rpartition("/")[2], reverse=True)
