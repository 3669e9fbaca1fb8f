"""One run at a time in a folder: another one is refused, whatever ended the first."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from polycube.errors import InputError
from polycube.io.access.lock import locked

HOLD = """
import sys, time
from pathlib import Path
from polycube.io.access.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_second_run_is_refused_by_name(tmp_path):
    with locked(tmp_path):
        match = rf"another run writes its results there; wait for process {os.getpid()} on "
        with pytest.raises(InputError, match=match) as refused, locked(tmp_path):
            pass
        assert str(refused.value).startswith(f"{tmp_path}: ")
        with locked(tmp_path / "other"):
            pass
    with locked(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_thread_is_another_run(tmp_path):
    refused = []

    def run() -> None:
        try:
            with locked(tmp_path):
                pass
        except InputError as error:
            refused.append(error)

    with locked(tmp_path):
        thread = threading.Thread(target=run)
        thread.start()
        thread.join()
    assert len(refused) == 1


def test_the_lock_of_a_killed_run_is_free(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None and other.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=f"process {other.pid} on"), locked(tmp_path):
            pass
        other.kill()
    with locked(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_results_keep_a_new_folder_and_a_failure_removes_it(tmp_path):
    with locked(tmp_path / "a" / "b"):
        Path(tmp_path / "a" / "b" / "result").touch()
    with locked(tmp_path / "c" / "d"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["result"]


def test_a_link_of_the_locks_name_is_not_followed(tmp_path):
    (tmp_path / "mine").write_text("words")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / ".polycube-lock").symlink_to(tmp_path / "mine")
    with locked(tmp_path / "run"):
        pass
    assert (tmp_path / "mine").read_text() == "words"
