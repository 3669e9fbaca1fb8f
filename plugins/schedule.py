"""Noise schedules: alpha_bar, the remaining share of the signal after each of T steps."""

from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("schedule", "linear")
@dataclass(frozen=True)
class Linear:
    """Noise schedule of the paper: beta_t grows linearly.

    Parameters
    ----------
    steps : T, the number of diffusion steps
    beta_start : noise variance of the first step
    beta_end : noise variance of the last step
    """

    steps: int = 500
    beta_start: float = 1e-4
    beta_end: float = 0.02

    def __call__(self) -> np.ndarray:
        """alpha_bar (T + 1,), decreasing from 1."""
        beta = np.linspace(self.beta_start, self.beta_end, self.steps)
        return np.append(1.0, np.cumprod(1 - beta))


@register("schedule", "cosine")
@dataclass(frozen=True)
class Cosine:
    """Cosine schedule: changes slowly at both ends.

    alpha_bar_t = f(t) / f(0), f(t) = cos^2((t / T + offset) / (1 + offset) pi / 2)

    Parameters
    ----------
    steps : T, the number of diffusion steps
    offset : offset of the time as a share of T, which makes the first steps larger
    beta_max : upper bound of the noise variance of a step; keeps alpha_bar_T positive
    """

    steps: int = 500
    offset: float = 0.008
    beta_max: float = 0.999

    def __call__(self) -> np.ndarray:
        """alpha_bar (T + 1,), decreasing from 1."""
        time = np.linspace(0, 1, self.steps + 1)
        f = np.cos((time + self.offset) / (1 + self.offset) * np.pi / 2) ** 2
        return _stepwise(f, self.beta_max)


@register("schedule", "sigmoid")
@dataclass(frozen=True)
class Sigmoid:
    """Sigmoid schedule: almost constant at both ends, fastest in the middle (Jabri et al., 2022).

    alpha_bar_t = (g(1) - g(t / T)) / (g(1) - g(0)), g(u) = 1 / (1 + exp(-(start + u (end - start))
    / tau))

    Parameters
    ----------
    steps : T, the number of diffusion steps
    start : argument of the sigmoid at the first step
    end : argument of the sigmoid at the last step
    tau : temperature; with a smaller one the schedule is steeper in the middle
    beta_max : upper bound of the noise variance of a step; keeps alpha_bar_T positive
    """

    steps: int = 500
    start: float = -3.0
    end: float = 3.0
    tau: float = 1.0
    beta_max: float = 0.999

    def __post_init__(self) -> None:
        if not self.start < self.end:
            raise ValueError(f"start must be below end; got {self.start} and {self.end}")
        # below it, the ends are constant in float64
        least = max(abs(self.start), abs(self.end)) / 30
        if not self.tau >= least:
            raise ValueError(f"tau must be at least {least:g} with this range; got {self.tau}")

    def __call__(self) -> np.ndarray:
        """alpha_bar (T + 1,), decreasing from 1."""
        from scipy.special import expit

        g = expit(np.linspace(self.start, self.end, self.steps + 1) / self.tau)
        return _stepwise((g[-1] - g) / (g[-1] - g[0]), self.beta_max)


def _stepwise(f: np.ndarray, beta_max: float) -> np.ndarray:
    """alpha_bar = f / f_0, with beta_t limited to beta_max."""
    return np.append(1.0, np.cumprod(np.maximum(f[1:] / f[:-1], 1 - beta_max)))
