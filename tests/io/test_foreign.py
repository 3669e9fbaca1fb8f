"""A reader in a process of its own: whatever it does, this one goes on with one sentence."""

import os
import sys
from pathlib import Path

import pytest

from polycube.errors import InputError
from polycube.io.foreign.process import read_alone, unreadable

WORKER = """
import json, os, signal, sys
from polycube.io.foreign.process import limit
request = json.load(sys.stdin)
limit(request)
{body}
"""


@pytest.fixture
def said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Does what a body says in the reading process; the sentence or what it wrote."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    monkeypatch.setattr("polycube.io.foreign.process.SECONDS", 1)
    path = tmp_path / "part.x"
    path.write_bytes(b"anything")

    def read(body: str) -> str:
        (tmp_path / "worker.py").write_text(WORKER.format(body=body))
        output, errors = read_alone("worker", path, {"more": "words"})
        return output.decode() if output is not None else str(unreadable(path, errors))

    return read


def test_what_it_writes_comes_back(said) -> None:
    assert said("open(request['output'], 'w').write(request['more'])") == "words"


@pytest.mark.slow
def test_one_that_never_ends_is_stopped(said) -> None:
    with pytest.raises(InputError, match="did not finish in 2 s; the file is damaged"):
        said("while True: pass")


def test_one_that_waits_is_stopped(said, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("polycube.io.foreign.process.PATIENCE", 0.5)
    with pytest.raises(InputError, match="did not finish in 2 s"):
        said("import time; time.sleep(60)")


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("bytearray(10 << 30)", "MemoryError"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", "its reader crashed"),
        ("sys.exit('what is wrong')", "what is wrong"),
        ("open(request['output'], 'w').write('half'); sys.exit('disk full')", "disk full"),
    ],
)
def test_one_that_fails_is_one_sentence(said, body: str, sentence: str) -> None:
    assert said(body) == f"not a readable .x file: {sentence}"
