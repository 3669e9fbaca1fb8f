"""Jobs of a batch as tasks of Dask: `infer.py mesh=parts dask.workers=4`.

A job whose worker dies is run by another; one that had ended is not run again, for its row is kept
(`batch.run_job`).
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from polycube.errors import InputError

Job = tuple[Callable[..., int], tuple[Any, ...], str]  # what is called, with what; a name for it


def is_used(dask: Mapping[str, Any]) -> bool:
    """Whether the settings `dask` ask for a cluster."""
    return bool(dask["scheduler"] or dask["workers"])


def check(dask: Mapping[str, Any], launcher: str) -> None:
    """Raise InputError where a cluster is asked for, and cannot be used."""
    if not is_used(dask):
        return
    if not launcher.endswith(".BasicLauncher"):
        raise InputError("the jobs run on Dask or by hydra/launcher, not both", "dask")
    if find_spec("distributed") is None:
        remedy = "pip install 'polycube[cluster]'"
        raise InputError("Dask is not installed", "dask", remedy)


def run_all(jobs: Sequence[Job], dask: Mapping[str, Any]) -> list[int]:
    """Exit codes of all jobs; 1 for one that took too many workers with it.

    Parameters
    ----------
    dask : settings: address of a running `scheduler`, or else a number of `workers`, processes of
        this machine; `deaths`, the number of workers that a job may take with it
    """
    from dask.config import set as configured
    from distributed import Client

    local = {"n_workers": dask["workers"], "threads_per_worker": 1, "dashboard_address": None}
    local |= {"silence_logs": logging.CRITICAL}
    with (
        configured({"distributed.scheduler.allowed-failures": dask["deaths"]}),
        Client(dask["scheduler"], **({} if dask["scheduler"] else local)) as client,
    ):
        tasks = [client.submit(call, *values, pure=False) for call, values, _ in jobs]
        return [_code(task, name) for task, (_, _, name) in zip(tasks, jobs, strict=True)]


def _code(task: Any, name: str) -> int:
    """Exit code of a task when it has ended."""
    error = task.exception()
    if error is None:
        return int(task.result())
    sys.stderr.write(f"{name}: failed; {type(error).__name__}: {' '.join(str(error).split())}\n")
    return 1
