"""Output of a run: one line per stage on the terminal, everything in its log file.

On a terminal, the last line shows the progress, see `polycube.cli.progress`.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from logging.handlers import MemoryHandler
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, cast

from polycube.errors import printable

if TYPE_CHECKING:
    from polycube.cli.progress import ProgressLine


logger = logging.getLogger(__name__)

# loggers with a line per stage
STAGES = ("polycube.pipeline", "polycube.search.loop", "polycube.stages", "polycube.cli")
QUIET, PLAIN, VERBOSE = logging.WARNING, logging.INFO, logging.DEBUG


class Terminal(logging.Handler):
    """Messages, and on a terminal the progress line below them.

    shown : QUIET for warnings, PLAIN for a line per stage too, VERBOSE for all
    """

    def __init__(self, stream: TextIO, shown: int) -> None:
        super().__init__()
        self.setFormatter(logging.Formatter("%(message)s"))
        self._stream = cast("TextIO", _Unbreakable(stream))
        self._shown = shown
        self._line: ProgressLine | None = None
        if stream.isatty() and os.environ.get("TERM") != "dumb" and shown <= PLAIN:
            from polycube.cli.progress import ProgressLine

            self._line = ProgressLine(self._stream)

    def emit(self, record: logging.LogRecord) -> None:
        """Write a message of a sufficient level; update the progress line."""
        if self._line and hasattr(record, "stage"):
            self._line.begin(record.stage)
        if self._line and hasattr(record, "best"):
            self._line.show_best(record.best)
        if self._line and self._is_shown(record):
            self._line.write(printable(self.format(record)))
        elif self._is_shown(record):
            self._stream.write(f"{printable(self.format(record))}\n")
            self._stream.flush()

    def _is_shown(self, record: logging.LogRecord) -> bool:
        if record.levelno < self._shown:
            return False
        return self._shown != PLAIN or record.name.startswith(STAGES) or record.levelno > PLAIN

    def close(self) -> None:
        """Remove the progress line."""
        if self._line:
            self._line.close()
            self._line = None
        super().close()


class _Unbreakable:
    """A stream without errors of writing: a closed terminal must not end a run."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> None:
        with suppress(OSError, ValueError):
            self._stream.write(text)

    def flush(self) -> None:
        with suppress(OSError, ValueError):
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class _LogFile(logging.FileHandler):
    """A log that is truncated if the disk is full, without ending the run."""

    def handleError(self, record: logging.LogRecord) -> None:
        pass

    def close(self) -> None:
        with suppress(OSError):
            super().close()


@contextmanager
def logging_to(shown: int, is_alone: bool = False) -> Iterator[Callable[[Path], None]]:
    """Log to the terminal, and to a file as soon as there is one; yields `log_to(path)`.

    is_alone : whether the process does nothing else, so that other output of libraries on stdout,
        stderr and as warnings is redirected to the file
    """
    root, warned = logging.getLogger("polycube"), logging.getLogger("py.warnings")
    before, opened = root.level, []
    early = MemoryHandler(10_000, flushLevel=logging.CRITICAL + 1, flushOnClose=False)

    def log_to(path: Path) -> None:
        file = _LogFile(path, mode="w", encoding="utf-8", errors="backslashreplace")
        file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
        early.setTarget(file)
        early.flush()
        for source in (root, warned):
            source.addHandler(file)
            source.removeHandler(early)
        opened.append(file)

    redirects = is_alone and _has_descriptors()
    stream: TextIO = sys.stderr
    if redirects:
        stream = os.fdopen(os.dup(2), "w", encoding="utf-8", errors="replace")
    terminal = Terminal(stream, shown)
    root.setLevel(logging.DEBUG)
    root.addHandler(terminal)
    for source in (root, warned):
        source.addHandler(early)
    logging.captureWarnings(is_alone)
    try:
        with _output_to_log() if redirects else nullcontext():
            yield log_to
    finally:
        logging.captureWarnings(False)
        root.setLevel(before)
        for handler in (terminal, early, *opened):
            root.removeHandler(handler)
            warned.removeHandler(handler)
            handler.close()
        if redirects:
            with suppress(OSError):
                stream.close()


@contextmanager
def _output_to_log() -> Iterator[None]:
    """Redirect the output of all libraries to the file descriptors 1 and 2 to the log."""
    copies = {number: os.dup(number) for number in (1, 2)}
    with tempfile.TemporaryFile() as output:
        for number in copies:
            os.dup2(output.fileno(), number)
        try:
            yield
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            for number, copy in copies.items():
                os.dup2(copy, number)
                os.close(copy)
            output.seek(0)
            for line in output.read().decode(errors="replace").splitlines():
                logger.debug("message of a library: %s", line)


@contextmanager
def ending_with_reader() -> Iterator[None]:
    """End the process with exit code 0 if its output is no longer read, as by `--help | head`."""
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the last flush
        sys.exit(0)


def _has_descriptors() -> bool:
    """Whether stdout and stderr are the descriptors 1 and 2: not in notebooks and some tests."""
    try:
        return (sys.stdout.fileno(), sys.stderr.fileno()) == (1, 2)
    except (OSError, ValueError, AttributeError):
        return False
