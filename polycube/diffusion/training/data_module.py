"""The pairs of a training as a LightningDataModule."""

from collections.abc import Callable
from typing import Any

import lightning.pytorch as L
from torch.utils.data import DataLoader

from polycube.diffusion.conditions import Condition
from polycube.diffusion.pairs.dataset import PairImages, training_loader, validation_loader

HELD_OUT = 10**9  # added to the seed for the held-out pairs, which choose the best checkpoint
JUDGED = 2 * HELD_OUT  # added to the seed for the pairs of a test and of `polycube.evaluate`


class PairData(L.LightningDataModule):
    """Endless pairs for the training, and two fixed sets that have none of them.

    pairs : the stream of the training
    others : seed -> stream of the held-out pairs and of the pairs of the test
    numbers : of held-out pairs and of pairs of the test, shared by all processes
    """

    def __init__(
        self,
        pairs: Callable[[int], Any],
        others: Callable[[int], Callable[[int], Any]],
        condition: Condition,
        seed: int,
        numbers: tuple[int, int],
        batch_size: int,
        batches_per_epoch: int,
        workers: int,
    ) -> None:
        super().__init__()
        self.pairs, self.others, self.condition, self.seed = pairs, others, condition, seed
        self.numbers, self.batch_size = numbers, batch_size
        self.batches_per_epoch, self.workers = batches_per_epoch, workers

    def train_dataloader(self) -> DataLoader:
        """Batches of consecutive epochs, after those that the module has finished."""
        trainer: Any = self.trainer
        return training_loader(
            PairImages(self.pairs, self.condition),
            self.batch_size,
            self.batches_per_epoch,
            self.workers,
            done=lambda: trainer.lightning_module.pairs_done,
        )

    def val_dataloader(self) -> DataLoader:
        """The held-out pairs, which choose the best checkpoint."""
        return self._first(self.numbers[0], HELD_OUT)

    def test_dataloader(self) -> DataLoader:
        """Pairs that neither the training nor the choice of a checkpoint has seen."""
        return self._first(self.numbers[1], JUDGED)

    def _first(self, number: int, offset: int) -> DataLoader:
        dataset = PairImages(self.others(self.seed + offset), self.condition)
        return validation_loader(dataset, number, self.batch_size)
