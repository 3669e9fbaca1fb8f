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
from pathlib import Path

import pytest

from polycube.cli.terminal import PLAIN, QUIET, VERBOSE, Terminal, logging_to
from tests.conftest import ROOT


def say() -> None:
    """What a run says: a stage that begins, a detail of it, its end, a warning."""
    stage = logging.getLogger("polycube.pipeline.stages")
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
        (
            VERBOSE,
            "meshing/smooth begins|a detail|meshing/smooth  1.2 s|best: 0.5|warning: look",
        ),
    ],
)
def test_a_line_per_stage_and_no_more(shown, words, tmp_path, monkeypatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    with logging_to(shown) as log_to:
        log_to(tmp_path / "run.log")
        say()
    assert stream.getvalue().splitlines() == words.split("|")
    kept = (tmp_path / "run.log").read_text()
    assert all(each in kept for each in ("smooth begins", "a detail", "1.2 s", "best: 0.5", "look"))


def test_what_was_said_before_there_is_a_folder_is_in_the_log_too(tmp_path) -> None:
    before = list(logging.getLogger("polycube").handlers)
    with logging_to(logging.CRITICAL) as log_to:
        say()
        log_to(tmp_path / "run.log")
        say()
    assert (tmp_path / "run.log").read_text().count("a detail") == 2
    assert logging.getLogger("polycube").handlers == before


def test_on_a_terminal_a_line_moves() -> None:
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as stream:
        terminal = Terminal(stream, PLAIN)
        log = logging.getLogger("polycube")
        log.addHandler(terminal)
        before, _ = log.level, log.setLevel(logging.DEBUG)
        try:
            say()
            time.sleep(0.6)
        finally:
            log.setLevel(before)
            log.removeHandler(terminal)
            terminal.close()
        said = ""
        while select.select([ours], [], [], 0.2)[0]:
            said += os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert re.search(r"meshing/smooth \d s, best scaled Jacobian 0\.500, \d s in all", said)
    assert "meshing/smooth  1.2 s\r\n" in said and "a detail" not in said
    assert said.endswith("\x1b[2K")  # the line is gone at the end


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


def test_what_libraries_say_goes_to_the_log(tmp_path: Path) -> None:
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


def test_warnings_are_warnings_again_afterwards() -> None:
    with logging_to(QUIET, is_alone=True):
        pass
    with pytest.warns(UserWarning, match="heard"):
        warnings.warn("heard", stacklevel=1)
