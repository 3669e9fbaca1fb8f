"""Classification of the primitives of the cells from a geometry.

The network sees only the geometry, in one of the 24 orientations of the axes of the grid. For every
cell it predicts the primitive, and for the geometry whether it is aligned with the grid in this
orientation. Contexts of equal shape cannot be distinguished; the canonical one is predicted
(`shapes.turned_contexts`).
"""

import torch
from torch import Tensor, nn

from polycube.diffusion.point_network import PointFeatures, perceptron


class ContextClassifier(nn.Module):
    """Geometry (B, channels, h, w) -> logits (B, cells, primitives + 1), and of alignment, (B,).

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
        self.leave = perceptron(2 * width, 2 * width, n_cells * (n_primitives + 1) + 1)

    def forward(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Logits of the cells, and of the alignment of the geometry with the grid."""
        inputs = geometry[:, : self.channels]
        features = self.features(inputs, geometry.new_ones(len(geometry), 1))
        outputs = self.leave(torch.cat([features.mean(dim=1), features.amax(dim=1)], dim=1))
        return outputs[:, :-1].reshape(-1, *self.shape), outputs[:, -1]

    def log_cells(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        """Log-probabilities (B, cells, primitives + 1), and that of alignment (B,)."""
        logits, alignment = self(geometry)
        return logits.float().log_softmax(dim=2), nn.functional.logsigmoid(alignment.float())

    def log_likelihood(self, geometry: Tensor, cells: Tensor) -> Tensor:
        """(B, C) log-probability of contexts, cells (C, n_cells) as numbers of classes.

        It includes the probability that the geometry is aligned with the grid.
        """
        log_p, log_aligned = self.log_cells(geometry)
        each = torch.arange(cells.shape[1])
        return log_p[:, each, cells].sum(dim=2) + log_aligned[:, None]
