"""A reader in a process of its own: whatever it does, this one goes on with one sentence."""

from pathlib import Path

import pytest

from polycube.errors import InputError
from polycube.io.foreign.process import read_separately, unreadable

WORKER = """
import json, os, signal, sys
from polycube.io.foreign.process import limit
request = json.load(sys.stdin)
limit(request)
{body}
"""


@pytest.fixture
def run_worker(tmp_path: Path, import_first, monkeypatch: pytest.MonkeyPatch):
    """A function that runs code in the reading process and returns its output or its error."""
    import_first(tmp_path)
    monkeypatch.setattr("polycube.io.foreign.process.SECONDS", 1)
    path = tmp_path / "part.x"
    path.write_bytes(b"anything")

    def read(body: str, patience: float = 5) -> str:
        monkeypatch.setattr("polycube.io.foreign.process.PATIENCE", patience)
        (tmp_path / "worker.py").write_text(WORKER.format(body=body))
        output, errors = read_separately("worker", path, {"more": "words"})
        return output.decode() if output is not None else str(unreadable(path, errors))

    return read


def test_the_output_is_returned(run_worker) -> None:
    assert run_worker("open(request['output'], 'w').write(request['more'])") == "words"


@pytest.mark.slow
def test_a_worker_that_never_ends_is_stopped(run_worker) -> None:
    with pytest.raises(InputError, match="did not finish in 2 s; the file is damaged"):
        run_worker("while True: pass")


def test_a_worker_that_waits_is_stopped(run_worker) -> None:
    with pytest.raises(InputError, match="did not finish in 2 s"):
        run_worker("import time; time.sleep(60)", patience=0.5)


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("bytearray(10 << 30)", "MemoryError"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", "its reader crashed"),
        ("sys.exit('what is wrong')", "what is wrong"),
        ("open(request['output'], 'w').write('half'); sys.exit('disk full')", "disk full"),
    ],
)
def test_a_failure_is_one_sentence(run_worker, body: str, sentence: str) -> None:
    assert run_worker(body) == f"not a readable .x file: {sentence}"
