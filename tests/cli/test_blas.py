"""Dense products run on one thread unless the user sets another number."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT

TASKS = "/proc/self/task"


def threads(imports: str, **settings: str) -> int:
    """How many threads a process has after some imports."""
    environment = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
    run = subprocess.run(
        [sys.executable, "-c", f"import {imports}, os; print(len(os.listdir({TASKS!r})))"],
        env=environment | settings,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return int(run.stdout)


@pytest.mark.slow
@pytest.mark.skipif(not Path(TASKS).is_dir(), reason="threads are counted as Linux does")
def test_the_commands_start_no_threads_for_dense_products():
    default = threads("numpy, scipy.linalg")
    if default == 1:
        pytest.skip("this machine has one core, so every program has one thread")
    assert threads("polycube.cli, numpy, scipy.linalg") == 1
    given = {"OPENBLAS_NUM_THREADS": str(os.cpu_count())}
    assert threads("polycube.cli, numpy, scipy.linalg", **given) == default
