"""A network with attention between all points of a set.

Queries and keys are rotated by angles proportional to the coordinates of their points (rotary
embedding: Su et al. 2021, here in space), so that attention depends on relative positions. The
result does not depend on the order of the points, and their number is arbitrary.
"""

import torch
from torch import Tensor, nn
from torch.nn.functional import pad, scaled_dot_product_attention

from polycube.diffusion.point_network import PointFeatures, perceptron

LONGEST, SHORTEST = torch.pi / 2, 8 * torch.pi  # wave numbers of positions in [-1, 1]


class Attention(nn.Module):
    """Attention between points, with several heads."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.enter = nn.Linear(width, 3 * width)
        self.leave = nn.Linear(width, width)

    def forward(self, x: Tensor, turn: Tensor) -> Tensor:
        """x (B, N, width); turn (2, B, 1, N, width / heads / 2) cosines and sines."""
        split = self.enter(x).unflatten(2, (3, self.heads, -1))
        query, key, value = split.permute(2, 0, 3, 1, 4)  # (B, heads, N, width / heads) each
        query, key = turned(query, turn), turned(key, turn)
        if x.is_cuda:
            attended = scaled_dot_product_attention(query, key, value)
        else:  # in half precision 2.5 times faster than that
            scores = query @ key.transpose(2, 3) * query.shape[-1] ** -0.5
            attended = scores.softmax(dim=3).to(value.dtype) @ value
        return self.leave(attended.transpose(1, 2).flatten(2))


def turned(x: Tensor, turn: Tensor) -> Tensor:
    """Pairs of features, from the first and second half, rotated by angles."""
    first, second = x.chunk(2, dim=-1)
    cosine, sine = turn
    return torch.cat([first * cosine - second * sine, first * sine + second * cosine], dim=-1)


class AttentionBlock(nn.Module):
    """Attention, then a perceptron on every point; both modulated by the given vector."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.norms = nn.ModuleList([nn.LayerNorm(width), nn.LayerNorm(width)])
        self.steer = nn.Linear(width, 4 * width)
        self.attention = Attention(width, heads)
        self.perceptron = perceptron(width, 2 * width, width)

    def forward(self, x: Tensor, given: Tensor, turn: Tensor) -> Tensor:
        """x (B, N, width), given (B, width), and turn as in `Attention`."""
        scale, shift, scale_2, shift_2 = self.steer(given)[:, None].chunk(4, dim=-1)
        x = x + self.attention(self.norms[0](x) * (1 + scale) + shift, turn)
        return x + self.perceptron(self.norms[1](x) * (1 + scale_2) + shift_2)


class PointTransformer(nn.Module):
    """(x (B, channels, h, w), t in [0, 1] (B,), context (B, K)) -> (B, outputs, h, w)."""

    waves: Tensor  # wave numbers of the rotations, a buffer

    def __init__(
        self,
        channels: int,
        outputs: int,
        context_length: int,
        width: int,
        blocks: int,
        heads: int,
        neighbours: int = 0,
    ) -> None:
        super().__init__()
        if width % (2 * heads):
            raise ValueError(f"model.width must be a multiple of {2 * heads}; got {width}")
        self.features = PointFeatures(channels, context_length + 1, width, 0, 0, neighbours)
        self.blocks = nn.ModuleList(AttentionBlock(width, heads) for _ in range(blocks))
        self.leave = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, outputs))
        self.n_turned = width // heads // 2
        waves = LONGEST * (SHORTEST / LONGEST) ** torch.linspace(0, 1, self.n_turned // 3)
        self.register_buffer("waves", waves, persistent=False)

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """The trained outputs, per pixel."""
        given = self.features.given(torch.cat([context, t[:, None].to(context)], dim=1))
        features = self.features.embedded(x)
        places = x[:, -6:-3] if x.shape[1] >= 6 else x[:, :3]  # of the geometry, if it is an input
        angle = (places.flatten(2).transpose(1, 2)[..., None] * self.waves).flatten(2)
        angle = pad(angle, (0, self.n_turned - angle.shape[2]))  # the last features are not rotated
        turn = torch.stack([angle.cos(), angle.sin()])[:, :, None].to(features.dtype)
        for block in self.blocks:
            features = block(features, given, turn)
        return self.leave(features).transpose(1, 2).reshape(len(x), -1, *x.shape[2:])
