"""Options of a training: losses, learning rates and averaged weights."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

DECAYS = ("constant", "linear", "cosine", "paper")
LOSSES = ("distance", "mse")


@dataclass(frozen=True)
class Learning:
    """Options of the training."""

    rate: float = 1e-3  # initial learning rate of Adam
    decay: str = "linear"  # of the rate over the epochs: constant, linear, cosine or paper
    loss: str = "distance"  # distance of points, or mse: mean squared error
    labels: float = 0.1  # weight of the cross-entropy of the labels
    endpoint: float = 0.8  # share of a batch trained at t = T from the geometry itself
    thin: int = 1  # train on every n-th row and column; 1 for networks that need whole images
    seed: int = 0

    def __post_init__(self) -> None:
        if self.thin < 1:
            raise ValueError(f"learning.thin must be at least 1; got {self.thin}")
        for name, choices in (("decay", DECAYS), ("loss", LOSSES)):
            if getattr(self, name) not in choices:
                raise ValueError(
                    f"learning.{name} must be one of {', '.join(choices)}; "
                    f"got {getattr(self, name)}"
                )
        if not 0 <= self.endpoint <= 1:
            raise ValueError(f"learning.endpoint must lie in [0, 1]; got {self.endpoint}")
        if self.labels < 0:
            raise ValueError(f"learning.labels must not be negative; got {self.labels}")


def rate_factors(decay: str, epochs: int) -> list[float]:
    """Learning rate of each epoch k = 0..K relative to the first.

    paper: eta_k = eta_{k-1} (1 - k / K); linear: eta_k = eta_0 (1 - k / K); cosine: eta_k = eta_0
    (1 + cos(pi k / K)) / 2
    """
    factors = [1.0]
    for k in range(1, epochs + 1):
        share = 1 - k / epochs
        factors.append(
            {
                "constant": 1.0,
                "linear": share,
                "cosine": (1 - np.cos(np.pi * share)) / 2,
                "paper": factors[-1] * share,
            }[decay]
        )
    return factors


def moving_average(decay: float) -> Callable[[Tensor, Tensor, Tensor], Tensor]:
    """Exponential moving average of weights; the decay is at most (1 + n) / (10 + n) at step n."""
    if not 0 < decay < 1:
        raise ValueError(f"ema must lie between 0 and 1; got {decay}")

    def average(averaged: Tensor, current: Tensor, n: Tensor) -> Tensor:
        share = min(decay, (1 + int(n)) / (10 + int(n)))
        return torch.lerp(current, averaged, share) if current.is_floating_point() else current

    return average
