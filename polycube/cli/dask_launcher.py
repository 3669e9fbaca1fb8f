"""Hydra launcher for a Dask cluster: `infer.py mesh=parts hydra/launcher=dask`.

A job whose worker dies is run by another; one that had ended is not run again, for its row is kept
(`batch.run_job`).
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, run_job, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, open_dict

from polycube.errors import InputError


class Dask(Launcher):
    """Runs every job as a task of its own."""

    def __init__(self, scheduler: str | None, workers: int, deaths: int) -> None:
        self.scheduler, self.workers, self.deaths = scheduler, workers, deaths

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """What Hydra gives to every launcher."""
        self.common = hydra_context, config, task_function

    def launch(
        self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int
    ) -> Sequence[JobReturn]:
        """Results of the jobs, in their order."""
        try:
            import dask
            from distributed import Client
        except ImportError:
            raise InputError(
                "hydra/launcher=dask needs dask: pip install 'polycube[cluster]'"
            ) from None
        setup_globals()
        _, config, _ = self.common
        Path(config.hydra.sweep.dir).mkdir(parents=True, exist_ok=True)
        dask.config.set({"distributed.scheduler.allowed-failures": self.deaths})
        local = {"n_workers": self.workers, "threads_per_worker": 1, "dashboard_address": None}
        local |= {"silence_logs": logging.CRITICAL}
        with Client(self.scheduler, **({} if self.scheduler else local)) as client:
            state = Singleton.get_state()
            numbered = enumerate(job_overrides, initial_job_idx)
            tasks = [
                client.submit(_job, number, list(words), *self.common, state, pure=False)
                for number, words in numbered
            ]
            return client.gather(tasks)


def _job(
    number: int,
    overrides: list[str],
    hydra_context: HydraContext,
    config: DictConfig,
    task_function: TaskFunction,
    state: dict[object, object],
) -> JobReturn:
    """On a worker: compose the job's config, and run it."""
    setup_globals()
    Singleton.set_state(state)
    job = hydra_context.config_loader.load_sweep_config(config, overrides)
    with open_dict(job):
        job.hydra.job.id, job.hydra.job.num = f"{job.hydra.job.name}_{number}", number
    HydraConfig.instance().set_config(job)
    return run_job(
        task_function=task_function,
        config=job,
        job_dir_key="hydra.sweep.dir",
        job_subdir_key="hydra.sweep.subdir",
        hydra_context=hydra_context,
    )


# Hydra takes launchers from its own name space only
known = Plugins.instance()  # which has imported that name space, where something is in it
sys.modules.setdefault("hydra_plugins", ModuleType("hydra_plugins")).__dict__.setdefault(
    "__path__", []
)
Dask.__module__ = "hydra_plugins.polycube"
sys.modules[Dask.__module__] = sys.modules[__name__]
known.register(Dask)
