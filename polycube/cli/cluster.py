"""Jobs of a batch as tasks of Dask: `infer.py mesh=parts dask.workers=4`.

A job whose worker dies is run by another worker; a finished job is not run again, because its row
exists (`batch.run_job`).
"""

import logging
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from polycube.errors import InputError

Job = tuple[Callable[..., int], tuple[Any, ...], str]  # function, arguments, name of the job


def is_used(dask: Mapping[str, Any]) -> bool:
    """Whether the settings `dask` request a cluster."""
    return bool(dask["scheduler"] or dask["workers"])


def check(dask: Mapping[str, Any], launcher: str) -> None:
    """Raise InputError if a cluster is requested and cannot be used."""
    if not is_used(dask):
        return
    if not launcher.endswith(".BasicLauncher"):
        raise InputError("the jobs run on Dask or by hydra/launcher, not both", "dask")
    if find_spec("distributed") is None:
        remedy = "pip install 'polycube[cluster]'"
        raise InputError("Dask is not installed", "dask", remedy)


def run_all(jobs: Sequence[Job], dask: Mapping[str, Any]) -> list[int]:
    """Exit codes of all jobs; 1 for a job that caused the death of too many workers.

    Parameters
    ----------
    dask : settings: address of a running `scheduler`, or number of `workers`, processes on this
        machine; `deaths`, the largest number of workers that may die with a job
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
    """Exit code of a task after its end."""
    error = task.exception()
    if error is None:
        return int(task.result())
    sys.stderr.write(f"{name}: failed; {type(error).__name__}: {' '.join(str(error).split())}\n")
    return 1
