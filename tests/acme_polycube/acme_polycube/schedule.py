"""Noise schedules."""

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("schedule", "quadratic")
@dataclass(frozen=True)
class Quadratic:
    """beta_t grows with the square of t: slow while most of the polycube is left.

    Parameters
    ----------
    steps : T, the number of diffusion steps
    beta_start, beta_end : noise variance of the first and of the last step
    """

    steps: int = 500
    beta_start: float = 1e-4
    beta_end: float = 0.03

    def __call__(self) -> np.ndarray:
        """alpha_bar, (T + 1,), from 1 down."""
        time = np.linspace(0, 1, self.steps)
        beta = self.beta_start + (self.beta_end - self.beta_start) * time**2
        return np.append(1.0, np.cumprod(1 - beta))
