"""The trainer of train.py is that of Lightning: its arguments, test runs, and sweepers."""

from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

import pytest
from hydra.core.utils import JobReturn
from hydra.experimental.callback import Callback
from lightning.pytorch.callbacks import EarlyStopping, ModelCheckpoint
from lightning.pytorch.loggers import CSVLogger
from omegaconf import OmegaConf

from polycube.cli import train as cli
from polycube.errors import InputError
from tests.fixtures.trainings import command, config

pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")

STOP = "{_target_: lightning.pytorch.callbacks.EarlyStopping, monitor: error}"


@pytest.mark.parametrize("callbacks", [f"[{STOP}]", f"{{stop: {STOP}}}"])
def test_arguments_of_the_user_are_kept(callbacks: str, tmp_path: Path) -> None:
    """Callbacks are added to those of the program; other arguments replace its own."""
    csv = f"{{_target_: lightning.pytorch.loggers.CSVLogger, save_dir: {tmp_path}}}"
    chosen = ["+trainer.limit_train_batches=1", "+trainer.enable_model_summary=true"]
    cfg = config(f"+trainer.callbacks={callbacks}", f"+trainer.logger={csv}", *chosen)
    trainer = cli._trainer(cfg, tmp_path)
    kinds = [type(each) for each in trainer.callbacks]
    assert kinds.count(EarlyStopping) == 1 and kinds.count(ModelCheckpoint) == 2
    assert isinstance(trainer.logger, CSVLogger)
    assert trainer.limit_train_batches == 1
    usual = cli._trainer(config("logger=csv", "callbacks=early_stopping"), tmp_path)
    assert isinstance(usual.logger, CSVLogger)
    assert [type(each) for each in usual.callbacks].count(EarlyStopping) == 1
    usual = cli._trainer(config(), tmp_path)
    assert usual.limit_train_batches == 2 and usual.logger.name == "tensorboard"


@pytest.mark.slow
def test_fast_dev_run_is_a_test_of_one_batch(tmp_path: Path) -> None:
    found = cli.train(config("+trainer.fast_dev_run=true"), tmp_path)
    assert found["steps"] == 1 and 0 < found["error"] < 10


@pytest.mark.slow
def test_pairs_that_chose_no_checkpoint_are_measured_at_the_end(tmp_path: Path) -> None:
    """They are other pairs than the held-out ones, with the final weights."""
    small = ("test=4", "optim=adamw", "learning.warmup=1", "compile=false")
    found = cli.train(config(*small, "trainer.max_epochs=1"), tmp_path)
    assert 0 < found["test_error"] < 10 and found["test_error"] != found["error"]


@pytest.mark.skipif(find_spec("wandb") is not None, reason="wandb is installed")
def test_a_logger_that_is_not_installed_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"WandbLogger cannot be made: .*wandb"):
        cli._trainer(config("logger=wandb"), tmp_path)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A training whose error is its rate."""
    monkeypatch.setattr(
        cli, "train", lambda cfg, folder: {"error": cfg["learning"]["rate"], "lr": 1}
    )


@pytest.mark.slow
def test_optuna_minimises_the_error(here: Path, quick: None) -> None:
    pytest.importorskip("hydra_plugins.hydra_optuna_sweeper")
    sweep = "+hydra.sweeper.params={learning.rate: 'choice(0.5, 0.25)'}"
    arguments = ("-m", "hydra/sweeper=optuna", "hydra.sweeper.n_trials=6", "seed=0", sweep)
    assert command(*arguments) == 0
    found = OmegaConf.load(next(here.rglob("optimization_results.yaml")))
    assert found.best_value == 0.25


@pytest.mark.slow
def test_without_a_limit_of_epochs_the_rate_stays(tmp_path: Path) -> None:
    """It was zero after the first epoch."""
    small = ("trainer.max_epochs=-1", "+trainer.max_steps=3", "batches_per_epoch=1")
    found = cli.train(config(*small, "learning.rate=1e-3"), tmp_path)
    assert found["steps"] == 3 and found["lr"] == pytest.approx(1e-3)


class Returned(Callback):
    """Collects what the jobs of a sweep return to Hydra."""

    values: ClassVar[list[object]] = []

    def on_job_end(self, config: object, job_return: JobReturn, **_: object) -> None:
        """The value that a sweeper such as Optuna's minimises."""
        self.values.append(job_return.return_value)


@pytest.mark.slow
def test_sweepers_receive_the_error(here: Path, quick: None) -> None:
    seen = "+hydra.callbacks.seen._target_=tests.cli.test_trainer.Returned"
    assert command("-m", "learning.rate=0.25,0.5", seen) == 0
    assert Returned.values == [0.25, 0.5]
