"""Pairs as torch images, in an endless order that a resumed training continues."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from polycube.diffusion.encoding import context_vector, image_size, point_order, to_pixels
from polycube.diffusion.pairs import Pair, Pairs


class Batch(NamedTuple):
    """Pairs as images, pixel by pixel; a single pair lacks the first dimension."""

    geometry: Tensor  # (B, 6, h, w) points and outward unit normals, 0 where padded
    polycube: Tensor  # (B, 3, h, w) x_0
    context: Tensor  # (B, K) context vectors
    labels: Tensor  # (B, 3, h, w) int64: axis, cell and wall of `Pair.labels`, -1 where padded
    number: Tensor  # (B,) int64 number of the pair in its stream


class PairImages(Dataset):
    """Pair `index` of a stream as images, its points in the given order."""

    def __init__(self, pairs: Pairs, primitives: tuple[str, ...], order: str = "x") -> None:
        self.pairs, self.primitives, self.order = pairs, primitives, order

    def __getitem__(self, index: int) -> Batch:
        pair = self.pairs(index)
        made = images(pair, self.pairs.grid, self.primitives, self.order)
        return Batch(*made, torch.tensor(index))


def images(
    pair: Pair, grid: tuple[int, ...], primitives: tuple[str, ...], by: str
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Geometry (6, h, w), polycube (3, h, w), context vector (K,) and labels (3, h, w)."""
    order, size = point_order(pair.geometry, by), image_size(grid)
    points, normals, polycube, labels = (
        to_pixels(rows, order, size)
        for rows in (pair.geometry, pair.normals, pair.polycube, pair.labels + 1)
    )
    arrays = (
        np.concatenate([points, normals]),
        polycube,
        context_vector(pair.context, primitives, int(np.prod(grid))),
        labels.astype(np.int64) - 1,
    )
    return tuple(map(torch.from_numpy, arrays))


class Onwards(Sampler):
    """Epoch e is the numbers e n ... (e + 1) n - 1: no pair twice, however often interrupted."""

    def __init__(self, n: int) -> None:
        self.n, self.epoch = n, 0

    def set_epoch(self, epoch: int) -> None:
        """Lightning calls this before each epoch."""
        self.epoch = epoch

    def __iter__(self) -> Iterator[int]:
        return iter(range(self.epoch * self.n, (self.epoch + 1) * self.n))

    def __len__(self) -> int:
        return self.n


def training_loader(
    dataset: PairImages, batch_size: int, batches_per_epoch: int, workers: int
) -> DataLoader:
    """Batches of one epoch after the other."""
    return DataLoader(
        dataset,
        batch_size=batch_size,
        sampler=Onwards(batch_size * batches_per_epoch),
        num_workers=workers,
        persistent_workers=workers > 0,
    )


def validation_loader(dataset: PairImages, n_pairs: int, batch_size: int) -> DataLoader:
    """The first pairs of a stream, made once and kept."""
    held_out = [dataset[i] for i in range(n_pairs)]
    return DataLoader(held_out, batch_size=batch_size)
