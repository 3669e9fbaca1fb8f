"""Pairs as torch images, in an endless order that a resumed training continues."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, distributed
from torch.utils.data import DataLoader, Dataset, Sampler

from polycube.diffusion.conditions import Condition
from polycube.diffusion.encoding import to_pixels, x_order
from polycube.diffusion.pairs.any_structure import LatticePair
from polycube.diffusion.pairs.pairs import Pair


class Batch(NamedTuple):
    """Pairs as images, pixel by pixel; a single pair lacks the first dimension."""

    geometry: Tensor  # (B, 6, h, w) points and outward unit normals, 0 where padded
    polycube: Tensor  # (B, 3, h, w) x_0
    context: Tensor  # (B, K) vectors of what is told
    labels: Tensor  # (B, L, h, w) int64: the labels of the condition, -1 where padded
    number: Tensor  # (B,) int64 number of the pair in its stream


class PairImages(Dataset):
    """Pair `index` of a stream as images."""

    def __init__(self, pairs: Callable[[int], Pair | LatticePair], condition: Condition) -> None:
        self.pairs, self.condition = pairs, condition

    def __getitem__(self, index: int) -> Batch:
        return Batch(*images(self.pairs(index), self.condition), torch.tensor(index))


class Kept(Dataset):
    """Items of another dataset, each made once."""

    def __init__(self, dataset: Dataset) -> None:
        self.made = cache(dataset.__getitem__)

    def __getitem__(self, index: int) -> Batch:
        return self.made(index)


def images(pair: Pair | LatticePair, condition: Condition) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Geometry (6, h, w), polycube (3, h, w), what is told (K,) and labels (L, h, w)."""
    order, size = x_order(pair.geometry), condition.image
    points, normals, polycube, labels = (
        to_pixels(rows, order, size)
        for rows in (pair.geometry, pair.normals, pair.polycube, pair.labels + 1)
    )
    return (
        torch.from_numpy(np.concatenate([points, normals])),
        torch.from_numpy(polycube),
        torch.from_numpy(condition.vector(condition.told(pair))),
        torch.from_numpy(labels.astype(np.int64) - 1),
    )


def place() -> tuple[int, int]:
    """Rank of this process among those that train together, and how many they are."""
    if distributed.is_available() and distributed.is_initialized():
        return distributed.get_rank(), distributed.get_world_size()
    return 0, 1


class Onwards(Sampler):
    """n numbers an epoch, from that of the pairs that are done: none twice, however interrupted.

    Of several processes each takes its n in turn: together, batch k is what a single process would
    have as its batch k, were it as large as all of theirs.  (Lightning's epoch will not do: where a
    training is resumed it is told to a sampler after its first numbers are with the workers.)
    """

    def __init__(self, n: int, done: Callable[[], int]) -> None:
        self.n, self.done = n, done

    def __iter__(self) -> Iterator[int]:
        (rank, processes), done = place(), self.done()
        return iter(range(done + rank, done + self.n * processes, processes))

    def __len__(self) -> int:
        return self.n


class HeldOut(Sampler):
    """The first n numbers, shared out among the processes."""

    def __init__(self, n: int) -> None:
        self.n = n

    def __iter__(self) -> Iterator[int]:
        return iter(self._numbers())

    def __len__(self) -> int:
        return len(self._numbers())

    def _numbers(self) -> range:
        rank, processes = place()
        return range(rank, self.n, processes)


def training_loader(
    dataset: PairImages,
    batch_size: int,
    batches_per_epoch: int,
    workers: int,
    done: Callable[[], int],
) -> DataLoader:
    """Batches of one epoch after the other; done says how many pairs all processes have seen."""
    return DataLoader(
        dataset,
        batch_size=batch_size,
        sampler=Onwards(batch_size * batches_per_epoch, done),
        num_workers=workers,
        persistent_workers=workers > 0,
    )


def validation_loader(dataset: PairImages, n_pairs: int, batch_size: int) -> DataLoader:
    """The first pairs of a stream, made once and kept."""
    return DataLoader(Kept(dataset), batch_size=batch_size, sampler=HeldOut(n_pairs))
