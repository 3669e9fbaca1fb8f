"""Several trainings, `train.py -m schedule=linear,cosine`, which TensorBoard compares."""

import logging

from hydra.experimental.callback import Callback
from omegaconf import DictConfig

from polycube.cli.command import begin_sweep

logger = logging.getLogger(__name__)


class Trainings(Callback):
    """The folder of a sweep in Hydra."""

    def on_multirun_start(self, config: DictConfig, **_: object) -> None:
        """Refuse a folder in which a file of the user would be overwritten."""
        begin_sweep(config, ())

    def on_multirun_end(self, config: DictConfig, **_: object) -> None:
        """Name the command that compares the trainings."""
        logger.info("to compare them: tensorboard --logdir %s", config.hydra.sweep.dir)
