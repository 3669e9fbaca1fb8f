"""A line per stage where nobody looks, a moving one on a terminal, everything in the log."""

import io
import logging
import os
import pty
import re
import select
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from polycube.cli.terminal import PLAIN, QUIET, VERBOSE, Terminal, logging_to
from tests.conftest import ROOT


def log_messages() -> None:
    """Messages of a run: a stage that begins, a detail of it, its end, a warning."""
    stage = logging.getLogger("polycube.stages")
    stage.debug("meshing/smooth begins", extra={"stage": "meshing/smooth"})
    logging.getLogger("polycube.fitting.polish").info("a detail")
    stage.info("meshing/smooth  1.2 s")
    logging.getLogger("polycube.pipeline.stopping").debug("best: 0.5", extra={"best": 0.5})
    logging.getLogger("polycube.fitting.polish").warning("warning: look")


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (QUIET, "warning: look"),
        (PLAIN, "meshing/smooth  1.2 s|warning: look"),
        (VERBOSE, "meshing/smooth begins|a detail|meshing/smooth  1.2 s|best: 0.5|warning: look"),
    ],
)
def test_a_line_per_stage_and_no_more(shown, words, tmp_path, monkeypatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with logging_to(shown) as log_to:
        log_to(tmp_path / "run.log")
        log_messages()
    assert stream.getvalue().splitlines() == words.split("|")
    logged = (tmp_path / "run.log").read_text()
    assert all(
        each in logged for each in ("smooth begins", "a detail", "1.2 s", "best: 0.5", "look")
    )


def test_messages_before_the_folder_exists_are_in_the_log_too(tmp_path) -> None:
    before = list(logging.getLogger("polycube").handlers)
    with logging_to(logging.CRITICAL) as log_to:
        log_messages()
        log_to(tmp_path / "run.log")
        log_messages()
    assert (tmp_path / "run.log").read_text().count("a detail") == 2
    assert logging.getLogger("polycube").handlers == before


@contextmanager
def on_a_terminal() -> Iterator[tuple[Terminal, Callable[[], str]]]:
    """A handler of messages on a pseudo-terminal, and a function that reads what was written."""
    ours, theirs = pty.openpty()

    def written() -> str:
        found = ""
        while select.select([ours], [], [], 0.2)[0]:
            found += os.read(ours, 1 << 16).decode()
        return found

    log = logging.getLogger("polycube")
    with os.fdopen(theirs, "w") as stream:
        terminal = Terminal(stream, PLAIN)
        log.addHandler(terminal)
        before, _ = log.level, log.setLevel(logging.DEBUG)
        try:
            yield terminal, written
        finally:
            log.setLevel(before)
            log.removeHandler(terminal)
            terminal.close()
    os.close(ours)


def test_on_a_terminal_the_last_line_shows_the_progress(monkeypatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    with on_a_terminal() as (terminal, written):
        log_messages()
        time.sleep(0.6)
        terminal.close()
        shown = written()
    plain = re.sub(r"\x1b\[[^A-Za-z]*[A-Za-z]", "", shown)
    assert re.search(r"meshing/smooth .* 0:00:00 +scaled Jacobian 0\.500", plain)
    assert "left" not in plain  # without the structures of this run there is no estimate
    assert "meshing/smooth  1.2 s\r\n" in plain and "a detail" not in plain
    assert shown.endswith("\x1b[1A\x1b[2K")  # the line is erased at the end


def test_a_terminal_without_control_codes_gets_messages_only(monkeypatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    with on_a_terminal() as (terminal, written):
        log_messages()
        terminal.close()
        assert written() == "meshing/smooth  1.2 s\r\nwarning: look\r\n"


def test_a_pipe_gets_no_control_codes_even_if_colours_are_forced(monkeypatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with logging_to(PLAIN):
        log_messages()
    assert stream.getvalue() == "meshing/smooth  1.2 s\nwarning: look\n"


CHATTER = """
import logging, os, subprocess, sys, warnings
from pathlib import Path
from polycube.cli.terminal import PLAIN, logging_to
with logging_to(PLAIN, is_alone=True) as log_to:
    log_to(Path("run.log"))
    os.write(2, b"from a library in C\\n")
    print("from a careless one")
    subprocess.run(["echo", "from a child"])
    warnings.warn("from a careful one")
    logging.getLogger("polycube.cli").info("from us")
print("after")
"""


def test_output_of_libraries_goes_to_the_log(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CHATTER],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "after\n", "from us\n")
    log = (tmp_path / "run.log").read_text()
    for who in ("library in C", "careless one", "child", "careful one", "us"):
        assert log.count(f"from {'a ' * (who != 'us')}{who}") == 1


def test_a_stream_that_was_closed_ends_no_run() -> None:
    stream = io.StringIO()
    terminal = Terminal(stream, PLAIN)
    stream.close()
    terminal.emit(logging.LogRecord("polycube.cli", logging.WARNING, "", 0, "said", (), None))
    terminal.close()


def test_a_terminal_that_is_closed_ends_no_run(monkeypatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    ours, theirs = pty.openpty()
    stderr = os.dup(2)
    os.dup2(theirs, 2)
    try:
        with logging_to(PLAIN):
            log_messages()
        monkeypatch.setattr(sys, "stderr", open(2, "w", closefd=False))
        monkeypatch.setattr(sys, "stdout", open(1, "w", closefd=False))
        with logging_to(PLAIN, is_alone=True):
            log_messages()
            os.close(ours)
            time.sleep(0.6)  # some updates of the line
            log_messages()
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(theirs)


def test_warnings_are_warnings_again_afterwards() -> None:
    with logging_to(QUIET, is_alone=True):
        pass
    with pytest.warns(UserWarning, match="heard"):
        warnings.warn("heard", stacklevel=1)
