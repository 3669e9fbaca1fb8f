"""Features of a point of a set from its neighbours.

A perceptron is applied to each of the k nearest points, with positions and normals relative to the
point; the maximum of each feature is taken. These features show fillets, edges and thin walls.
"""

import torch
from torch import Tensor, nn

INPUTS = 9  # numbers of a neighbour: its position, its normal, and that of the point


class Neighbourhood(nn.Module):
    """Features (B, N, width) of points (B, N, 3) and normals (B, N, 3) from their neighbours."""

    def __init__(self, width: int, neighbours: int) -> None:
        super().__init__()
        self.neighbours = neighbours
        self.look = nn.Sequential(
            nn.Linear(INPUTS, width // 2), nn.GELU(), nn.Linear(width // 2, width // 2)
        )
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
