"""Noise schedules: how much of the polycube is left after each of T steps."""

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("schedule", "linear")
@dataclass(frozen=True)
class Linear:
    """beta_t grows linearly (the paper's schedule)."""

    steps: int = 500
    beta_start: float = 1e-4
    beta_end: float = 0.02

    def __call__(self) -> np.ndarray:
        """alpha_bar, (T + 1,), from 1 down."""
        beta = np.linspace(self.beta_start, self.beta_end, self.steps)
        return np.append(1.0, np.cumprod(1 - beta))


@register("schedule", "cosine")
@dataclass(frozen=True)
class Cosine:
    """alpha_bar_t = f(t) / f(0), f(t) = cos^2((t / T + offset) / (1 + offset) pi / 2)."""

    steps: int = 500
    offset: float = 0.008
    beta_max: float = 0.999  # keeps alpha_bar_T above zero

    def __call__(self) -> np.ndarray:
        """alpha_bar, (T + 1,), from 1 down."""
        time = np.linspace(0, 1, self.steps + 1)
        f = np.cos((time + self.offset) / (1 + self.offset) * np.pi / 2) ** 2
        return np.append(1.0, np.cumprod(np.maximum(f[1:] / f[:-1], 1 - self.beta_max)))
