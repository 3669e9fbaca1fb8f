"""A network that sees points, not pictures: each pixel is a point of a set.

Blocks of a perceptron shared by all points; in between, what all points have in common (mean and
maximum of the features) joins time and context, and scales and shifts the features of every point.
The order of the points in the image does not matter.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn


class SharedBlock(nn.Module):
    """Residual perceptron on every point, steered by a summary of all points."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.steer = nn.Sequential(
            nn.Linear(3 * width, width), nn.GELU(), nn.Linear(width, 2 * width)
        )
        self.perceptron = nn.Sequential(
            nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width)
        )

    def forward(self, x: Tensor, given: Tensor) -> Tensor:
        """x (B, N, width) and what is known of all points, given (B, width)."""
        normed = self.norm(x)
        common = torch.cat([normed.mean(dim=1), normed.amax(dim=1), given], dim=1)
        scale, shift = self.steer(common)[:, None].chunk(2, dim=-1)  # (B, 1, width) each
        return x + self.perceptron(normed * (1 + scale) + shift)


class PointNetwork(nn.Module):
    """(x (B, channels, h, w), t in [0, 1] (B,), context (B, K)) -> (B, 3, h, w)."""

    def __init__(
        self, channels: int, context_length: int, width: int = 128, blocks: int = 6
    ) -> None:
        super().__init__()
        waves = 2.0 ** torch.arange(4) * torch.pi / 2
        self.register_buffer("waves", waves, persistent=False)
        self.enter = nn.Linear(channels * (1 + 2 * len(waves)), width)
        self.given = nn.Sequential(
            nn.Linear(context_length + 1, width), nn.GELU(), nn.Linear(width, width)
        )
        self.blocks = nn.ModuleList(SharedBlock(width) for _ in range(blocks))
        self.leave = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, 3))

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """Predicted noise or x_0, whichever the network is trained for."""
        points = x.flatten(2).transpose(1, 2)  # (B, N, channels)
        phase = (points[..., None] * self.waves).flatten(2)
        features = self.enter(torch.cat([points, phase.sin(), phase.cos()], dim=2))
        given = self.given(torch.cat([context, t[:, None].to(context)], dim=1))
        for block in self.blocks:
            features = block(features, given)
        return self.leave(features).transpose(1, 2).reshape(len(x), 3, *x.shape[2:])
