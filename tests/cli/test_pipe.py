"""A pipe whose reader ends early, as of `| head`, gives no traceback."""

import subprocess
import sys

import pytest

from polycube import HOME


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["--help"], ["--cfg", "job"]])
def test_a_closed_pipe_is_no_error(arguments: list[str]) -> None:
    program = subprocess.Popen(
        [sys.executable, str(HOME / "infer.py"), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    program.stdout.close()
    assert (program.stderr.read(), program.wait()) == ("", 0)
    program.stderr.close()
