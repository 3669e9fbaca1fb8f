"""Nothing is looked up or downloaded while the programs run."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.fixtures.runs import FAST
from tests.fixtures.trainings import SMALL

# a program that ends with exit code 77 where it asks for an address or another machine
ALONE = """
import os, sys
def audit(event, arguments):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.sendto"):
        sys.__stderr__.write(f"{event} {arguments}")
        os._exit(77)
sys.addaudithook(audit)
"""
INFER = ["mesh=example:rod", *FAST, "order=[meshing]", "quiet=true"]


def run(code: str, *arguments: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-c", ALONE + code, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)


def test_a_name_lookup_is_detected() -> None:
    assert run("import socket; socket.getaddrinfo('localhost', 80)").returncode == 77


@pytest.mark.slow
def test_inference_needs_no_internet(tmp_path: Path) -> None:
    code = "from polycube.cli import infer_command; infer_command()"
    ended = run(code, *INFER, f"output_dir={tmp_path}")
    assert ended.returncode == 0, ended.stderr


@pytest.mark.slow
def test_training_needs_no_internet(tmp_path: Path) -> None:
    code = "from polycube.cli import train_command; train_command()"
    ended = run(code, *SMALL, "trainer.max_epochs=1", f"hydra.run.dir={tmp_path}/run")
    assert ended.returncode == 0, ended.stderr
