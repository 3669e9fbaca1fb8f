"""The trained half: network and process together, from geometry points to polycube points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from polycube.diffusion.encoding import (
    context_length,
    context_vector,
    image_size,
    to_pixels,
    to_points,
    x_order,
)
from polycube.diffusion.pairs import n_sample_points
from polycube.diffusion.process import DiffusionProcess, Predict
from polycube.diffusion.templates import Context

# (predict, x_T, process, generator) -> x_0 (B, 3, h, w) and the kept states (S, B, 3, h, w)
Sampler = Callable[[Predict, Tensor, DiffusionProcess, torch.Generator], tuple[Tensor, Tensor]]


@dataclass(frozen=True)
class DenoiserOptions:
    """What a network was trained to see and to say."""

    target: str = "x0"  # what the network predicts: x0 or noise
    geometry_channels: bool = True  # the geometry beside x_t as three more channels
    noise_scale: float = 0.25  # s, in learning-frame units; the paper has 1
    pads: bool = False  # single cells have 512 points and zeros, as published

    def __post_init__(self) -> None:
        if self.target not in ("x0", "noise"):
            raise ValueError(f"target must be x0 or noise; got {self.target!r}")


class Denoiser(nn.Module):
    """A network with its process, its grid and the contexts it knows.

    network : (channels, context_length, image) -> module, as a model plugin makes it
    """

    def __init__(
        self,
        network: Callable[[int, int, tuple[int, int]], nn.Module],
        alpha_bar: np.ndarray,
        grid: Sequence[int],
        primitives: Sequence[str],
        options: DenoiserOptions,
    ) -> None:
        super().__init__()
        self.grid, self.primitives, self.options = tuple(grid), tuple(primitives), options
        self.process = DiffusionProcess(alpha_bar, options.noise_scale)
        self.image = image_size(grid)
        n_cells = int(np.prod(grid))
        channels = 6 if options.geometry_channels else 3
        length = context_length(len(self.primitives), n_cells)
        self.network = network(channels, length, self.image)

    def forward(self, x_t: Tensor, geometry: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """What the network says about x_t (B, 3, h, w) at steps t (B,): x_0 or noise."""
        x = torch.cat([x_t, geometry], dim=1) if self.options.geometry_channels else x_t
        return self.network(x, t.float() / self.process.steps, context)

    def predict(self, geometry: Tensor, context: Tensor) -> Predict:
        """x_0 predicted from (x_t, t) for images of a geometry and their context vectors."""
        q = self.process.adjustment(geometry)

        def x_0(x_t: Tensor, t: int) -> Tensor:
            steps = torch.full((len(x_t),), t, device=x_t.device)
            said = self(x_t, geometry, steps, context).float()
            return said if self.options.target == "x0" else self.process.origin(x_t, said, q, steps)

        return x_0

    def n_points(self, context: Context) -> int:
        """Sample points of a geometry of this context."""
        return n_sample_points(context, self.options.pads)

    def vectors(self, contexts: Sequence[Context]) -> Tensor:
        """(B, K) context vectors; raises LookupError for a primitive that was not trained."""
        n_cells = int(np.prod(self.grid))
        rows = [context_vector(context, self.primitives, n_cells) for context in contexts]
        return torch.from_numpy(np.stack(rows))

    @torch.no_grad()
    def denoise(
        self, points: np.ndarray, contexts: Sequence[Context], sampler: Sampler, seed: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Polycube points for (B, N, 3) points of geometries in the learning frame.

        Returns
        -------
        points : (B, N, 3) on the polycube, cell edge 1, origin at the grid's lowest corner
        trajectory : (S, B, N, 3) kept states from x_T to x_0, shifted likewise
        """
        self.eval()
        order = x_order(points)
        x_T = torch.from_numpy(to_pixels(points, order, self.image))
        predict = self.predict(x_T, self.vectors(contexts))
        x_0, states = sampler(predict, x_T, self.process, torch.Generator().manual_seed(seed))
        origin = np.array(self.grid) / 2
        trajectory = np.stack([to_points(s.numpy(), order) for s in states])
        return to_points(x_0.numpy(), order) + origin, trajectory + origin
