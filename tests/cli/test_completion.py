"""Completion of options by the shell, as Hydra's scripts ask for it."""

import os
import subprocess
import sys

import pytest

from tests.conftest import ROOT


@pytest.mark.slow
@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("structure=d", {"structure=diffusion", "structure=drawn"}),
        ("meshing.si", {"meshing.size="}),
    ],
)
def test_a_word_is_completed(typed: str, expected: set[str]) -> None:
    done = subprocess.run(
        [sys.executable, "infer.py", "-sc", "query=bash"],
        cwd=ROOT,
        env=os.environ | {"COMP_LINE": f"python infer.py {typed}"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert set(done.stdout.split()) == expected
