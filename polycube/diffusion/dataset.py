"""Pairs as torch images, in an endless order that a resumed training continues."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from polycube.diffusion.encoding import context_vector, image_size, to_pixels, x_order
from polycube.diffusion.pairs import Pair, Pairs

Batch = tuple[Tensor, Tensor, Tensor]  # geometry and polycube (B, 3, h, w), contexts (B, K)


class PairImages(Dataset):
    """Pair `index` as images of geometry and polycube, sorted by the geometry's x, and context."""

    def __init__(self, pairs: Pairs, primitives: tuple[str, ...]) -> None:
        self.pairs, self.primitives = pairs, primitives

    def __getitem__(self, index: int) -> Batch:
        pair = self.pairs(index)
        return images(pair, self.pairs.grid, self.primitives)


def images(pair: Pair, grid: tuple[int, ...], primitives: tuple[str, ...]) -> Batch:
    """Images (3, h, w) of geometry and polycube and the context vector (K,), float32."""
    order, size = x_order(pair.geometry), image_size(grid)
    arrays = (
        to_pixels(pair.geometry, order, size),
        to_pixels(pair.polycube, order, size),
        context_vector(pair.context, primitives, int(np.prod(grid))),
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
