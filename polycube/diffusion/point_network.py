"""Networks on a set of points: each pixel is a point of a set.

They consist of blocks of a perceptron shared by all points. Between them, the mean and maximum of
the features of all points are combined with time and context, and scale and shift the features of
every point. A few slots also collect features of the points assigned to them and return them, so
that parts of the shape, such as the wall of a hole, are treated together. The result does not
depend on the order of the points, and their number is arbitrary.
"""

import torch
from torch import Tensor, nn

INPUTS = 9  # numbers of a neighbour: its position, its normal, and that of the point


def perceptron(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    """Linear, GELU, linear."""
    return nn.Sequential(nn.Linear(inputs, hidden), nn.GELU(), nn.Linear(hidden, outputs))


class Slots(nn.Module):
    """Soft assignment of points to slots, which collect, exchange and return features."""

    def __init__(self, width: int, slots: int) -> None:
        super().__init__()
        self.assign = nn.Linear(width, slots)
        self.mix = nn.Linear(slots, slots)
        self.perceptron = nn.Sequential(nn.LayerNorm(width), *perceptron(width, 2 * width, width))

    def forward(self, x: Tensor, given: Tensor) -> Tensor:
        """Features returned to points x (B, N, width); given (B, width) is added to each slot."""
        assigned = self.assign(x).float()  # (B, N, slots)
        gathered = assigned.softmax(dim=1).transpose(1, 2).to(x.dtype) @ x + given[:, None]
        gathered = gathered + self.mix(gathered.transpose(1, 2)).transpose(1, 2)
        return assigned.softmax(dim=2).to(x.dtype) @ self.perceptron(gathered)


class SharedBlock(nn.Module):
    """Residual perceptron on every point, modulated by a summary of all points."""

    def __init__(self, width: int, slots: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.slots = Slots(width, slots)
        self.steer = perceptron(3 * width, width, 2 * width)
        self.perceptron = perceptron(width, 2 * width, width)

    def forward(self, x: Tensor, given: Tensor) -> Tensor:
        """x (B, N, width), and given (B, width), the common information of all points."""
        normed = self.norm(x)
        common = torch.cat([normed.mean(dim=1), normed.amax(dim=1), given], dim=1)
        scale, shift = self.steer(common)[:, None].chunk(2, dim=-1)  # (B, 1, width) each
        return x + self.slots(normed, given) + self.perceptron(normed * (1 + scale) + shift)


class PointFeatures(nn.Module):
    """Features (B, N, width) of the points of images (B, channels, h, w) and a vector (B, given).

    The first three channels are coordinates, which are also encoded as waves.

    neighbours : number of neighbours of each point that are additional input, from the last six
        channels, which are positions and normals then; 0: none
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
        self.given = perceptron(given, width, width)
        self.blocks = nn.ModuleList(SharedBlock(width, slots) for _ in range(blocks))

    def embedded(self, x: Tensor) -> Tensor:
        """Features of each point and of its neighbours, before the blocks."""
        points = x.flatten(2).transpose(1, 2)  # (B, N, channels)
        phase = (points[..., :3, None] * self.waves).flatten(2)
        features = self.enter(torch.cat([points, phase.sin(), phase.cos()], dim=2))
        if self.around is not None:
            features = features + self.around(points[..., -6:-3], points[..., -3:])
        return features

    def forward(self, x: Tensor, given: Tensor) -> Tensor:
        """One row of features per pixel, row by row."""
        features, given = self.embedded(x), self.given(given)
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
        """The trained outputs, per pixel."""
        features = self.features(x, torch.cat([context, t[:, None].to(context)], dim=1))
        return self.leave(features).transpose(1, 2).reshape(len(x), -1, *x.shape[2:])


class Neighbourhood(nn.Module):
    """Features (B, N, width) of points (B, N, 3) and normals (B, N, 3) from their neighbours."""

    def __init__(self, width: int, neighbours: int) -> None:
        super().__init__()
        self.neighbours = neighbours
        self.look = perceptron(INPUTS, width // 2, width // 2)
        self.leave = nn.Linear(width // 2, width)

    def forward(self, points: Tensor, normals: Tensor) -> Tensor:
        """Distances are relative to the mean distance of the farthest of the neighbours."""
        near = nearest(points, self.neighbours)
        batch = torch.arange(len(points), device=points.device)[:, None, None]
        away = points[batch, near] - points[:, :, None]  # (B, N, k, 3)
        reach = away[:, :, -1].norm(dim=2).mean(dim=1)[:, None, None, None]
        own = normals[:, :, None].expand_as(away)
        inputs = torch.cat([away / (reach + 1e-6), normals[batch, near], own], dim=3)
        return self.leave(self.look(inputs).amax(dim=2))


def nearest(points: Tensor, k: int) -> Tensor:
    """(B, N, k) the nearest other points of each point (B, N, 3), nearest first."""
    k = min(k, points.shape[1] - 1)
    with torch.no_grad(), torch.autocast(points.device.type, enabled=False):
        apart = torch.cdist(points.float(), points.float())
        apart.diagonal(dim1=1, dim2=2).fill_(torch.inf)
        return apart.topk(k, dim=2, largest=False).indices


class ContextClassifier(nn.Module):
    """Geometry (B, channels, h, w) -> logits (B, cells, primitives + 1), and of alignment, (B,).

    The network sees only the geometry, in one of the 24 orientations of the axes of the grid. For
    every cell it predicts the primitive, and for the geometry whether it is aligned with the grid
    in this orientation. Contexts of equal shape cannot be distinguished; the canonical one is
    predicted (`shapes.turned_contexts`). The last class of a cell is empty.
    """

    def __init__(
        self,
        channels: int,
        n_cells: int,
        n_primitives: int,
        width: int = 64,
        blocks: int = 3,
        slots: int = 16,
    ) -> None:
        super().__init__()
        self.channels, self.shape = channels, (n_cells, n_primitives + 1)
        self.features = PointFeatures(channels, 1, width, blocks, slots)
        self.leave = perceptron(2 * width, 2 * width, n_cells * (n_primitives + 1) + 1)

    def forward(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Logits of the cells, and of the alignment of the geometry with the grid."""
        features = self.features(geometry[:, : self.channels], geometry.new_ones(len(geometry), 1))
        outputs = self.leave(torch.cat([features.mean(dim=1), features.amax(dim=1)], dim=1))
        return outputs[:, :-1].reshape(-1, *self.shape), outputs[:, -1]

    def log_cells(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Log-probabilities (B, cells, primitives + 1), and that of alignment (B,)."""
        logits, alignment = self(geometry)
        return logits.float().log_softmax(dim=2), nn.functional.logsigmoid(alignment.float())
