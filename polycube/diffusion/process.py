"""The diffusion process from polycube to geometry, and one step back (paper, eqs. 1 to 5).

    x_t = sqrt(alpha_t) x_{t-1} + sqrt(1 - alpha_t) (s z + q),   z ~ N(0, I)        (1)

With the adjustment q, the process ends in a geometry instead of pure noise; s scales the noise (1
in the paper). A schedule gives alpha_bar; all other coefficients are derived here.
"""

from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor

# (x_t, t) -> predicted x_0: a network with given geometry and context
Predict = Callable[[Tensor, int], Tensor]


class DiffusionProcess:
    """Coefficients of every step t = 0..T, with the names of the paper.

    alpha_bar, alpha, beta : (T + 1,), alpha_bar_0 = alpha_0 = 1
    drift : (T + 1,) c_t with Q_t = c_t q: c_t = sqrt(alpha_t) c_{t-1} + sqrt(1 - alpha_t), c_0 = 0
    noise_scale : s
    """

    def __init__(self, alpha_bar: np.ndarray, noise_scale: float = 1.0) -> None:
        alpha_bar = np.asarray(alpha_bar, dtype=np.float64)
        if alpha_bar.ndim != 1 or len(alpha_bar) < 2 or alpha_bar[0] != 1 or alpha_bar[-1] <= 0:
            raise ValueError(f"alpha_bar must start at 1 and be positive; got {alpha_bar}")
        if not (np.diff(alpha_bar) < 0).all():
            raise ValueError("alpha_bar must decrease in every step")
        alpha = np.append(1.0, alpha_bar[1:] / alpha_bar[:-1])
        drift = np.zeros_like(alpha)
        for t in range(1, len(alpha)):
            drift[t] = np.sqrt(alpha[t]) * drift[t - 1] + np.sqrt(1 - alpha[t])
        self.steps = len(alpha) - 1
        self.noise_scale = noise_scale
        self.alpha_bar, self.alpha, self.beta, self.drift = map(
            torch.from_numpy, (alpha_bar, alpha, 1 - alpha, drift)
        )
        self._factors: dict[torch.device, Tensor] = {}

    def adjustment(self, geometry: Tensor) -> Tensor:
        """The q whose cumulative influence Q_T = c_T q is the geometry."""
        return geometry / float(self.drift[-1])

    def forward(self, x_0: Tensor, z: Tensor, q: Tensor, t: Tensor) -> Tensor:
        """x_t = sqrt(alpha_bar_t) x_0 + sqrt(1 - alpha_bar_t) s z + c_t q (eq. 2).

        x_0, z, q : (B, 3, height, width); t : (B,) int64
        """
        signal, noise, drift = self._at(t, x_0)
        return signal * x_0 + noise * z + drift * q

    def noise(self, x_t: Tensor, x_0: Tensor, q: Tensor, t: Tensor) -> Tensor:
        """The z for which `forward` gives x_t."""
        signal, noise, drift = self._at(t, x_t)
        return (x_t - signal * x_0 - drift * q) / noise

    def origin(self, x_t: Tensor, z: Tensor, q: Tensor, t: Tensor) -> Tensor:
        """The x_0 for which `forward` gives x_t."""
        signal, noise, drift = self._at(t, x_t)
        return (x_t - noise * z - drift * q) / signal

    def velocity(self, x_0: Tensor, z: Tensor, t: Tensor) -> Tensor:
        """v_t = sqrt(alpha_bar_t) s z - sqrt(1 - alpha_bar_t) x_0 (Salimans and Ho, 2022).

        Without its drift, x'_t = x_t - c_t q = sqrt(alpha_bar_t) x_0 + sqrt(1 - alpha_bar_t) s z
        rotates from x_0 to the noise s z by an angle; v_t is its derivative with respect to that
        angle. The drift is given by the geometry, so it is not part of the prediction.
        """
        signal, noise, _ = self._at(t, x_0)
        return signal * self.noise_scale * z - noise / self.noise_scale * x_0

    def origin_of_velocity(self, x_t: Tensor, v: Tensor, q: Tensor, t: Tensor) -> Tensor:
        """x_0 = sqrt(alpha_bar_t) (x_t - c_t q) - sqrt(1 - alpha_bar_t) v_t, the inverse."""
        signal, noise, drift = self._at(t, x_t)
        return signal * (x_t - drift * q) - noise / self.noise_scale * v

    def reverse_mean(self, x_t: Tensor, z: Tensor, q: Tensor, t: int) -> Tensor:
        """mu'_t = (x'_t - beta_t / sqrt(1 - alpha_bar_t) (s z + q'_t)) / sqrt(alpha_t) (eq. 5).

        q'_t = sqrt(1 - alpha_bar_t) / sqrt(1 - alpha_t) q reverts the drift of one step exactly.
        """
        alpha, alpha_bar = float(self.alpha[t]), float(self.alpha_bar[t])
        q_prime = ((1 - alpha_bar) / (1 - alpha)) ** 0.5 * q
        share = (1 - alpha) / (1 - alpha_bar) ** 0.5
        return (x_t - share * (self.noise_scale * z + q_prime)) / alpha**0.5

    def posterior_variance(self, t: int) -> float:
        """s^2 beta_t (1 - alpha_bar_{t-1}) / (1 - alpha_bar_t), variance of q(x_{t-1} | x_t, x_0).

        `reverse_mean` with the z implied by x_0 is its mean: x'_t = x_t - c_t q follows a process
        without drift, so q changes the mean only.
        """
        share = (1 - self.alpha_bar[t - 1]) / (1 - self.alpha_bar[t])
        return self.noise_scale**2 * float(self.beta[t] * share)

    def renewed(self, t: int, after: int) -> float:
        """Share of the remaining variance at step `after` < t that is new, given x_t and x_0."""
        here, there = float(self.alpha_bar[t]), float(self.alpha_bar[after])
        return (1 - here / there) / (1 - here)

    def _at(self, t: Tensor, like: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Factors of x_0, z and q at steps t, in the shape of the given images."""
        if t.device not in self._factors:  # copied once, because a copy waits for a GPU
            signal, noise = self.alpha_bar.sqrt(), (1 - self.alpha_bar).sqrt() * self.noise_scale
            self._factors[t.device] = torch.stack([signal, noise, self.drift]).to(t.device)
        factors = self._factors[t.device][:, t]
        shape = (-1, *[1] * (like.ndim - 1))
        signal, noise, drift = (factor.to(like).reshape(shape) for factor in factors)
        return signal, noise, drift


def kept_steps(steps: int) -> list[int]:
    """Steps whose states are recorded, descending: T, T - 1, T - 21, 19, 0 as in the paper."""
    wanted = {steps, steps - 1, steps - 21, 19, 0}
    return sorted((t for t in wanted if 0 <= t <= steps), reverse=True)
