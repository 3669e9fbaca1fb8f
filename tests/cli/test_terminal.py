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
def test_a_line_per_stage_and_no_more(shown, words, tmp_path, capsys) -> None:
    with logging_to(shown) as log_to:
        log_to(tmp_path / "run.log")
        log_messages()
    assert capsys.readouterr().err.splitlines() == words.split("|")
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


@pytest.fixture
def on_a_terminal(kind: str, monkeypatch) -> Iterator[tuple[Terminal, Callable[[], str]]]:
    """A handler of messages on a pseudo-terminal, and a function that reads what was written."""
    monkeypatch.setenv("TERM", kind)
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


@pytest.mark.parametrize("kind", ["xterm"])
def test_on_a_terminal_the_last_line_shows_the_progress(on_a_terminal) -> None:
    terminal, written = on_a_terminal
    log_messages()
    time.sleep(0.6)
    terminal.close()
    shown = written()
    plain = re.sub(r"\x1b\[[^A-Za-z]*[A-Za-z]", "", shown)
    assert re.search(r"meshing/smooth .* 0:00:00 +scaled Jacobian 0\.500", plain)
    assert "left" not in plain  # without the structures of this run there is no estimate
    assert "meshing/smooth  1.2 s\r\n" in plain and "a detail" not in plain
    assert shown.endswith("\x1b[1A\x1b[2K")  # the line is erased at the end


@pytest.mark.parametrize("kind", ["dumb"])
def test_a_terminal_without_control_codes_gets_messages_only(on_a_terminal) -> None:
    terminal, written = on_a_terminal
    log_messages()
    terminal.close()
    assert written() == "meshing/smooth  1.2 s\r\nwarning: look\r\n"


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
    logging.getLogger("polycube.stages").debug("meshing/smooth begins", extra={"stage": "smooth"})
    logging.getLogger("polycube.stages").info("meshing/smooth  1.2 s")
    logging.getLogger("polycube.cli").info("from us")
print("after")
"""


def test_output_of_libraries_goes_to_the_log(tmp_path: Path) -> None:
    """And a pipe gets no control codes, even if colours are forced."""
    done = subprocess.run(
        [sys.executable, "-c", CHATTER],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT), "FORCE_COLOR": "1"},
    )
    assert (done.returncode, done.stdout) == (0, "after\n")
    assert done.stderr == "meshing/smooth  1.2 s\nfrom us\n"
    log = (tmp_path / "run.log").read_text()
    for who in ("library in C", "careless one", "child", "careful one", "us"):
        assert log.count(f"from {'a ' * (who != 'us')}{who}") == 1


def test_a_stream_that_was_closed_ends_no_run() -> None:
    stream = io.StringIO()
    terminal = Terminal(stream, PLAIN)
    stream.close()
    terminal.emit(logging.LogRecord("polycube.cli", logging.WARNING, "", 0, "said", (), None))
    terminal.close()


LONELY = """
import time
from polycube.cli.terminal import PLAIN, logging_to
from tests.cli.test_terminal import log_messages
for is_alone in (False, True):
    with logging_to(PLAIN, is_alone):
        log_messages()
        if is_alone:
            input()  # until the terminal is closed
            time.sleep(0.6)  # some updates of the line
            log_messages()
"""


def test_a_terminal_that_is_closed_ends_no_run() -> None:
    ours, theirs = pty.openpty()
    given = {"stdin": subprocess.PIPE, "stdout": theirs, "stderr": theirs}
    env = os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm"}
    with subprocess.Popen([sys.executable, "-c", LONELY], env=env, **given) as process:
        os.close(theirs)
        shown = b""
        while shown.count(b"warning: look") < 2:
            shown += os.read(ours, 1 << 16)
        os.close(ours)
        process.communicate(b"\n")
    assert process.returncode == 0


def test_warnings_are_warnings_again_afterwards() -> None:
    with logging_to(QUIET, is_alone=True):
        pass
    with pytest.warns(UserWarning, match="heard"):
        warnings.warn("heard", stacklevel=1)
