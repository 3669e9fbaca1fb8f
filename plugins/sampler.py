"""Reverse diffusion from the geometry x_T to the polycube x_0 (paper, Algorithm 2)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from polycube.registry import register
from polycube.types.options import Count, Options, Share

if TYPE_CHECKING:
    from torch import Generator, Tensor

    from polycube.diffusion.process import DiffusionProcess, Predict


@register("sampler", "ddpm")
@dataclass(frozen=True)
class Ddpm(Options):
    """Algorithm 2 of the paper: all T steps, with new noise in each.

    x_{t-1} = mu'_t + sigma_t z.  sigma_t^2 is s^2 beta_t, as in Algorithm 2, exact if x_0 is noise
    of variance s^2; or the variance of q(x_{t-1} | x_t, x_0), as below eq. 4, exact if x_0 is known
    (Ho et al., 2020).

    Parameters
    ----------
    variance : variance of the noise: beta (as in the paper) or posterior (smaller, exact for a
        known x_0)
    noise : factor of the standard deviation sigma_t; 0: no noise, which gives the mean
    """

    variance: Literal["beta", "posterior"] = "beta"
    noise: float = 1.0

    def __call__(
        self, predict: Predict, x_T: Tensor, process: DiffusionProcess, generator: Generator
    ) -> tuple[Tensor, Tensor]:
        """x_0 and the recorded states from x_T to it, (B, 3, h, w) and (S, B, 3, h, w)."""
        import torch

        from polycube.diffusion.process import kept_steps

        q, x_t, states = process.adjustment(x_T), x_T, [x_T]
        recorded = kept_steps(process.steps)
        for t in range(process.steps, 0, -1):
            z = process.noise(x_t, predict(x_t, t), q, torch.full((len(x_T),), t))
            x_t = process.reverse_mean(x_t, z, q, t)
            if t > 1:
                sigma = self._variance(process, t) ** 0.5
                x_t = x_t + self.noise * sigma * torch.randn(x_t.shape, generator=generator).to(x_t)
            if t - 1 in recorded:
                states.append(x_t)
        return x_t, torch.stack(states)

    def _variance(self, process: DiffusionProcess, t: int) -> float:
        if self.variance == "posterior":
            return process.posterior_variance(t)
        return process.noise_scale**2 * float(process.beta[t])


@register("sampler", "ddim")
@dataclass(frozen=True)
class Ddim(Options):
    """DDIM: a few steps; without noise the result is the mean instead of a random sample.

    Recorded states between two steps are interpolated by the forward process. The noise follows
    Song et al. (2021): after each step, a share of the standard deviation is replaced by new noise.
    With noise=1, a step from t to t - 1 is that of `ddpm` with the posterior variance.

    Parameters
    ----------
    steps : number of network evaluations; with more steps, points are closer to the polycube but
        farther from their places on it
    noise : factor of the standard deviation of the new noise in each step, 0 to 1; 0: no noise
    """

    steps: Count = 1
    noise: Share = 0.0

    def __call__(
        self, predict: Predict, x_T: Tensor, process: DiffusionProcess, generator: Generator
    ) -> tuple[Tensor, Tensor]:
        """x_0 and the recorded states from x_T to it, (B, 3, h, w) and (S, B, 3, h, w)."""
        import torch

        from polycube.diffusion.process import kept_steps

        T = process.steps
        times = sorted({round(T * i / self.steps) for i in range(self.steps + 1)}, reverse=True)
        q, x_t, states = process.adjustment(x_T), x_T, [x_T]
        for t, after in pairwise(times):
            x_0 = predict(x_t, t)
            z = process.noise(x_t, x_0, q, torch.full((len(x_T),), t))
            if self.noise and after:
                share = self.noise * process.renewed(t, after) ** 0.5
                new = torch.randn(z.shape, generator=generator).to(z)
                z = (1 - share**2) ** 0.5 * z + share * new
            recorded = [step for step in kept_steps(T) if after <= step < t]
            steps = (torch.full((len(x_T),), step) for step in [*recorded, after])
            *between, x_t = (process.forward(x_0, z, q, step) for step in steps)
            states += between
        return x_t, torch.stack(states)
