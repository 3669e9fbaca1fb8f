"""Which primitive fills which cell: a network that reads the context off a geometry.

It looks at the geometry alone, in any of the 24 orientations of the grid's axes, and says for
every cell what fills it, and whether the geometry lies along the grid as it is turned at all.
Contexts of equal shape cannot be told apart; it says the canonical one (`shapes.turned_contexts`).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from polycube.diffusion.point_network import PointFeatures


class ContextClassifier(nn.Module):
    """Geometry (B, channels, h, w) -> logits (B, cells, primitives + 1) and of fitting, (B,).

    The last class of a cell is empty.
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
        self.leave = nn.Sequential(
            nn.Linear(2 * width, 2 * width),
            nn.GELU(),
            nn.Linear(2 * width, n_cells * (n_primitives + 1) + 1),
        )

    def forward(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Logits of the cells and of the geometry lying along the grid."""
        seen = geometry[:, : self.channels]
        features = self.features(seen, geometry.new_ones(len(geometry), 1))
        said = self.leave(torch.cat([features.mean(dim=1), features.amax(dim=1)], dim=1))
        return said[:, :-1].reshape(-1, *self.shape), said[:, -1]

    def log_cells(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Log-probabilities (B, cells, primitives + 1) and, of lying along the grid, (B,)."""
        logits, fits = self(geometry)
        return logits.float().log_softmax(dim=2), nn.functional.logsigmoid(fits.float())

    def log_likelihood(self, geometry: Tensor, cells: Tensor) -> Tensor:
        """(B, C) log-probability of contexts, cells (C, n_cells) as numbers of classes.

        That the geometry lies along the grid, and that its cells are filled like that.
        """
        log_p, log_along = self.log_cells(geometry)
        each = torch.arange(cells.shape[1])
        return log_p[:, each, cells].sum(dim=2) + log_along[:, None]
