"""A reader who goes before all is said gets no traceback."""

import subprocess
import sys

import pytest

from polycube import HOME


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["--help"], ["--cfg", "job"]])
def test_a_reader_may_go(arguments: list[str]) -> None:
    program = subprocess.Popen(
        [sys.executable, str(HOME / "infer.py"), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    program.stdout.close()
    assert (program.stderr.read(), program.wait()) == ("", 0)
    program.stderr.close()
