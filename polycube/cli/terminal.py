"""Output of a run: one line per stage on the terminal, everything in its log file.

On a terminal, a status line shows the current stage, its time, and the best scaled Jacobian so far.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from logging.handlers import MemoryHandler
from pathlib import Path
from typing import TextIO

logger = logging.getLogger(__name__)

STAGES = ("polycube.pipeline", "polycube.cli")  # loggers with a line per stage
EVERY = 0.25  # seconds between two updates of the status line
QUIET, PLAIN, VERBOSE = logging.WARNING, logging.INFO, logging.DEBUG


class Terminal(logging.Handler):
    """Messages, and on a terminal the status line below them.

    shown : QUIET for warnings, PLAIN for a line per stage too, VERBOSE for all
    """

    def __init__(self, stream: TextIO, shown: int) -> None:
        super().__init__()
        self.setFormatter(logging.Formatter("%(message)s"))
        self._stream, self._shown = stream, shown
        self._begin = time.monotonic()
        self._stage, self._since, self._best = "", self._begin, ""
        self._end = threading.Event()
        self._mover: threading.Thread | None = None
        if stream.isatty() and shown <= PLAIN:
            self._mover = threading.Thread(target=self._move, daemon=True)
            self._mover.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a message of a sufficient level; update the current stage and the best value."""
        if hasattr(record, "stage"):
            self._stage, self._since = record.stage, time.monotonic()
        if hasattr(record, "best"):
            self._best = f", best scaled Jacobian {record.best:.3f}"
        if self._is_shown(record):
            self._write(f"{self._blank()}{self.format(record)}\n{self._line()}")

    def _is_shown(self, record: logging.LogRecord) -> bool:
        if record.levelno < self._shown:
            return False
        is_stage = record.name.startswith(STAGES)
        return self._shown != PLAIN or is_stage or record.levelno > PLAIN

    def _move(self) -> None:
        while not self._end.wait(EVERY):
            self.acquire()
            try:
                self._write(self._blank() + self._line())
            finally:
                self.release()

    def _blank(self) -> str:
        return "" if self._mover is None else "\r\x1b[2K"

    def _line(self) -> str:
        if self._mover is None or not self._stage:
            return ""
        now = time.monotonic()
        spent = f"{now - self._since:.0f} s{self._best}, {now - self._begin:.0f} s in all"
        columns = os.get_terminal_size(self._stream.fileno()).columns or 80  # 0 if it is unknown
        return f"{self._stage} {spent}"[: columns - 1]

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):  # a closed terminal must not end a run
            self._shown = logging.CRITICAL + 1

    def close(self) -> None:
        """Remove the status line."""
        self._end.set()
        if self._mover is not None:
            self._mover.join()
            self._write(self._blank())
            self._mover = None
        super().close()


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
    root, heard = logging.getLogger("polycube"), logging.getLogger("py.warnings")
    before, opened = root.level, []
    early = MemoryHandler(10_000, flushLevel=logging.CRITICAL + 1, flushOnClose=False)

    def log_to(path: Path) -> None:
        file = _LogFile(path, mode="w", encoding="utf-8")
        file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
        early.setTarget(file)
        early.flush()
        for source in (root, heard):
            source.addHandler(file)
            source.removeHandler(early)
        opened.append(file)

    with _caught(is_alone) as stream:
        terminal = Terminal(stream, shown)
        root.setLevel(logging.DEBUG)
        root.addHandler(terminal)
        for source in (root, heard):
            source.addHandler(early)
        logging.captureWarnings(is_alone)
        try:
            with _heard(is_alone):
                yield log_to
        finally:
            logging.captureWarnings(False)
            root.setLevel(before)
            for handler in (terminal, early, *opened):
                root.removeHandler(handler)
                heard.removeHandler(handler)
                handler.close()


@contextmanager
def _caught(is_alone: bool) -> Iterator[TextIO]:
    """The stream for messages; a copy if stderr itself is redirected."""
    if not (is_alone and _has_descriptors()):
        yield sys.stderr
        return
    with os.fdopen(os.dup(2), "w", encoding="utf-8", errors="replace") as stream:
        yield stream


@contextmanager
def _heard(is_alone: bool) -> Iterator[None]:
    """Redirect the output of all libraries to the file descriptors 1 and 2 to the log."""
    if not (is_alone and _has_descriptors()):
        yield
        return
    kept = {number: os.dup(number) for number in (1, 2)}
    with tempfile.TemporaryFile() as chatter:
        for number in kept:
            os.dup2(chatter.fileno(), number)
        try:
            yield
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            for number, copy in kept.items():
                os.dup2(copy, number)
                os.close(copy)
            chatter.seek(0)
            for line in chatter.read().decode(errors="replace").splitlines():
                logger.debug("message of a library: %s", line)


def _has_descriptors() -> bool:
    """Whether stdout and stderr are the descriptors 1 and 2: not in notebooks and some tests."""
    try:
        return (sys.stdout.fileno(), sys.stderr.fileno()) == (1, 2)
    except (OSError, ValueError, AttributeError):
        return False
