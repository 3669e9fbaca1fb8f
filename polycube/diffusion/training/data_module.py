"""The pairs of a training as a LightningDataModule."""

from collections.abc import Callable
from typing import Any

import lightning.pytorch as L
import torch
from torch.utils.data import DataLoader

from polycube.diffusion.conditions import Condition
from polycube.diffusion.pairs.dataset import ConsecutiveNumbers, PairImages, rank_and_processes

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
        number = self.batch_size * self.batches_per_epoch
        return DataLoader(
            PairImages(self.pairs, self.condition),
            self.batch_size,
            sampler=ConsecutiveNumbers(number, lambda: trainer.lightning_module.pairs_done),
            num_workers=self.workers,
            persistent_workers=self.workers > 0,
            pin_memory=torch.cuda.is_available(),
        )

    def val_dataloader(self) -> DataLoader:
        """The held-out pairs, which choose the best checkpoint."""
        return self._first(self.numbers[0], HELD_OUT)

    def test_dataloader(self) -> DataLoader:
        """Pairs that neither the training nor the choice of a checkpoint has seen."""
        return self._first(self.numbers[1], JUDGED)

    def _first(self, number: int, offset: int) -> DataLoader:
        """The first pairs of a stream, made once and divided among the processes."""
        images = PairImages(self.others(self.seed + offset), self.condition)
        rank, processes = rank_and_processes()
        made: Any = [images[index] for index in range(rank, number, processes)]
        return DataLoader(made, self.batch_size)
