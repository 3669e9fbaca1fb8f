"""Noise schedules."""

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("schedule", "sigmoid")
@dataclass(frozen=True)
class Sigmoid:
    """beta_t rises along a sigmoid: slow at both ends, fast in the middle."""

    steps: int = 500
    slope: float = 6.0
    beta_start: float = 1e-4
    beta_end: float = 0.02

    def __call__(self) -> np.ndarray:
        """alpha_bar, (T + 1,), from 1 down."""
        rise = 1 / (1 + np.exp(-np.linspace(-self.slope, self.slope, self.steps)))
        beta = self.beta_start + (self.beta_end - self.beta_start) * rise
        return np.append(1.0, np.cumprod(1 - beta))
