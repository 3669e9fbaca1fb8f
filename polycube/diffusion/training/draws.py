"""Random values of the pairs of a batch, computed on the device of the training.

They are a hash of the seed, the number of the pair and the position of the value (SplitMix64:
Steele, Lea and Flood, 2014), so they depend neither on the batch nor on the number of processes.
"""

from typing import NamedTuple

import torch
from torch import Tensor

from polycube.diffusion.pairs.templates import IDENTITY

GOLDEN = -0x61C8864680B583EB  # 2^64 / golden ratio, as the other constants a signed number
FIRST, SECOND = -0x40A7B892E31B1A47, -0x6B2FB644ECCEEE15
BITS = 24  # of a uniform number in single precision


class Draws(NamedTuple):
    """Random values for each pair of a batch."""

    t: Tensor  # (B,) int64 steps 1..T
    first: Tensor  # (B,) bool: trained at the start of sampling, t = T, instead
    turn: Tensor  # (B,) int64 0..23, rotation of the input of the classifier; half are IDENTITY
    z: Tensor  # (B, 3, h, w) standard normal


def draws(seed: int, numbers: Tensor, steps: int, endpoint: float, image: tuple[int, int]) -> Draws:
    """Random values for images of the given size, for the pairs with these numbers (B,).

    steps : T; endpoint : share of the pairs with `first`
    """
    size = 3 * image[0] * image[1]
    u = uniform(seed, numbers, 4 + 2 * size)
    turn = torch.where(u[:, 2] < 0.5, IDENTITY, (u[:, 3] * 24).long())
    radius = (-2 * (1 - u[:, 4 : 4 + size]).log()).sqrt()  # Box and Muller, 1958
    z = radius * (2 * torch.pi * u[:, 4 + size :]).cos()
    return Draws(1 + (u[:, 0] * steps).long(), u[:, 1] < endpoint, turn, z.reshape(-1, 3, *image))


def uniform(seed: int, numbers: Tensor, count: int) -> Tensor:
    """(B, count) single precision numbers, uniform in [0, 1)."""
    stream = _mixed(_mixed(numbers + GOLDEN) + torch.full_like(numbers, seed) * GOLDEN)
    position = torch.arange(1, count + 1, device=numbers.device)
    return _shifted(_mixed(stream[:, None] + position * GOLDEN), 64 - BITS).float() / 2**BITS


def _mixed(x: Tensor) -> Tensor:
    """The finalizer of SplitMix64; products of int64 are modulo 2^64."""
    x = (x ^ _shifted(x, 30)) * FIRST
    x = (x ^ _shifted(x, 27)) * SECOND
    return x ^ _shifted(x, 31)


def _shifted(x: Tensor, bits: int) -> Tensor:
    """Shifted right, with zeros from the left."""
    return (x >> bits) & ((1 << (64 - bits)) - 1)
