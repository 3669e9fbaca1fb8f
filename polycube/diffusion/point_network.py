"""A network that sees points, not pictures: each pixel is a point of a set.

Blocks of a perceptron shared by all points; in between, what all points have in common (mean and
maximum of the features) joins time and context, and scales and shifts the features of every point,
and a few slots gather from the points that they are assigned to and give back to them: parts of
the shape, such as the wall of a hole, are seen as one.  The order of the points in the image does
not matter, and any number of points will do.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from polycube.diffusion.neighbourhood import Neighbourhood


class Slots(nn.Module):
    """Points softly assigned to slots: the slots gather, mix among themselves and give back."""

    def __init__(self, width: int, slots: int) -> None:
        super().__init__()
        self.assign = nn.Linear(width, slots)
        self.mix = nn.Linear(slots, slots)
        self.perceptron = nn.Sequential(
            nn.LayerNorm(width), nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width)
        )

    def forward(self, x: Tensor, given: Tensor) -> Tensor:
        """What each of the points x (B, N, width) takes back; given (B, width) joins each slot."""
        assigned = self.assign(x).float()  # (B, N, slots)
        gathered = assigned.softmax(dim=1).transpose(1, 2).to(x.dtype) @ x + given[:, None]
        gathered = gathered + self.mix(gathered.transpose(1, 2)).transpose(1, 2)
        return assigned.softmax(dim=2).to(x.dtype) @ self.perceptron(gathered)


class SharedBlock(nn.Module):
    """Residual perceptron on every point, steered by a summary of all points."""

    def __init__(self, width: int, slots: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.slots = Slots(width, slots)
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
        return x + self.slots(normed, given) + self.perceptron(normed * (1 + scale) + shift)


class PointFeatures(nn.Module):
    """Features (B, N, width) of the points of images (B, channels, h, w) and a vector (B, given).

    The first three channels are coordinates, which also enter as waves.

    neighbours : points around each that it sees by themselves, in the last six channels, which are
        then places and normals; 0: none
    """

    waves: Tensor  # (4,) wave numbers, a buffer

    def __init__(
        self, channels: int, given: int, width: int, blocks: int, slots: int, neighbours: int = 0
    ) -> None:
        super().__init__()
        if neighbours and channels < 6:
            raise ValueError(f"model.neighbours needs places and normals; got {channels} channels")
        self.around = Neighbourhood(width, neighbours) if neighbours else None
        waves = 2.0 ** torch.arange(4) * torch.pi / 2
        self.register_buffer("waves", waves, persistent=False)
        self.enter = nn.Linear(channels + 6 * len(waves), width)
        self.given = nn.Sequential(nn.Linear(given, width), nn.GELU(), nn.Linear(width, width))
        self.blocks = nn.ModuleList(SharedBlock(width, slots) for _ in range(blocks))

    def seen(self, x: Tensor) -> Tensor:
        """What each point is by itself and beside its neighbours, before the blocks."""
        points = x.flatten(2).transpose(1, 2)  # (B, N, channels)
        phase = (points[..., :3, None] * self.waves).flatten(2)
        features = self.enter(torch.cat([points, phase.sin(), phase.cos()], dim=2))
        if self.around is not None:
            features = features + self.around(points[..., -6:-3], points[..., -3:])
        return features

    def forward(self, x: Tensor, given: Tensor) -> Tensor:
        """One row of features per pixel, row by row."""
        features, given = self.seen(x), self.given(given)
        for block in self.blocks:
            features = block(features, given)
        return features


class PointNetwork(nn.Module):
    """(x (B, channels, h, w), t in [0, 1] (B,), context (B, K)) -> (B, outputs, h, w)."""

    def __init__(
        self,
        channels: int,
        outputs: int,
        context_length: int,
        width: int = 128,
        blocks: int = 6,
        slots: int = 32,
        neighbours: int = 0,
    ) -> None:
        super().__init__()
        given = context_length + 1
        self.features = PointFeatures(channels, given, width, blocks, slots, neighbours)
        self.leave = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, outputs))

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """Whatever the network is trained for, per pixel."""
        features = self.features(x, torch.cat([context, t[:, None].to(context)], dim=1))
        said = self.leave(features).transpose(1, 2)
        return said.reshape(len(x), -1, *x.shape[2:])
