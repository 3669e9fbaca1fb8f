"""The pairs of a training as a LightningDataModule.

They are torch images, in an endless order in which a resumed training continues.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import lightning.pytorch as L
import numpy as np
import torch
from torch import Tensor, distributed
from torch.utils.data import DataLoader, Dataset, Sampler

from polycube.diffusion.conditions import Condition
from polycube.diffusion.encoding import by_x, to_pixels
from polycube.diffusion.pairs.any_structure import LatticePair
from polycube.diffusion.pairs.pairs import Pair

HELD_OUT = 10**9  # added to the seed for the held-out pairs, which choose the best checkpoint
JUDGED = 2 * HELD_OUT  # added to the seed for the pairs of a test and of `polycube.evaluate`


class Batch(NamedTuple):
    """Pairs as images, pixel by pixel; a single pair has no first dimension."""

    geometry: Tensor  # (B, 6, h, w) points and outward unit normals, 0 in padding
    polycube: Tensor  # (B, 3, h, w) x_0
    context: Tensor  # (B, K) condition vectors
    labels: Tensor  # (B, L, h, w) int64: the labels of the condition, -1 in padding
    number: Tensor  # (B,) int64 number of the pair in its stream


class PairImages(Dataset):
    """Pair `index` of a stream as images."""

    def __init__(self, pairs: Callable[[int], Pair | LatticePair], condition: Condition) -> None:
        self.pairs, self.condition = pairs, condition

    def __getitem__(self, index: int) -> Batch:
        pair, size = self.pairs(index), self.condition.image
        value = self.condition.value_of(pair)
        used = self.condition.pixels(value, pads=len(pair.geometry) < size[0] * size[1])
        at = by_x(pair.geometry, used)
        rows = pair.geometry, pair.normals, pair.polycube, pair.labels + 1
        points, normals, polycube, labels = (to_pixels(each, at, size) for each in rows)
        return Batch(
            torch.from_numpy(np.concatenate([points, normals])),
            torch.from_numpy(polycube),
            torch.from_numpy(self.condition.vector(value)),
            torch.from_numpy(labels.astype(np.int64) - 1),
            torch.tensor(index),
        )


def rank_and_processes() -> tuple[int, int]:
    """Rank of this process in the training, and the number of processes."""
    if distributed.is_available() and distributed.is_initialized():
        return distributed.get_rank(), distributed.get_world_size()
    return 0, 1


class ConsecutiveNumbers(Sampler):
    """Sampler of n numbers per epoch, starting after the finished pairs, without repetitions.

    Several processes share the numbers: together, their batches k are the batch k of a single
    process with the sum of their batch sizes. (The epoch of Lightning cannot be used: in a resumed
    training, the sampler receives it after the workers have the first numbers.)
    """

    def __init__(self, n: int, done: Callable[[], int]) -> None:
        self.n, self.done = n, done

    def __iter__(self) -> Iterator[int]:
        (rank, processes), done = rank_and_processes(), self.done()
        return iter(range(done + rank, done + self.n * processes, processes))

    def __len__(self) -> int:
        return self.n


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
