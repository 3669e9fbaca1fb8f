"""Options of a training: losses, learning rates, averaged weights, and its checkpoints."""

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO
from torch import Tensor

from polycube.io.manifest import writing
from polycube.types.options import Count, Options, Share, limits


@dataclass(frozen=True)
class Learning(Options):
    """Options of the training."""

    group = "learning."

    rate: float = 1e-3  # initial learning rate
    # number of batches in which the rate rises linearly from 0
    warmup: Annotated[int, limits(0)] = 0
    # of the rate over the epochs
    decay: Literal["constant", "linear", "cosine", "printed"] = "linear"
    loss: Literal["distance", "mse"] = "distance"  # distance of points, or mse: mean squared error
    labels: Annotated[float, limits(0)] = 0.1  # weight of the cross-entropy of the labels
    endpoint: Share = 0.8  # share of a batch trained at t = T from the geometry itself
    thin: Count = 1  # train on every n-th row and column; 1 for networks that need whole images
    seed: int = 0


def rate_factors(decay: str, epochs: int) -> list[float]:
    """Learning rate of each epoch k = 0..K relative to the first.

    linear: eta_k = eta_0 (1 - k / K); cosine: eta_k = eta_0 (1 + cos(pi k / K)) / 2;
    printed, the formula in the paper: eta_k = eta_{k-1} (1 - k / K), whose product vanishes early
    """
    share = 1 - np.arange(epochs + 1) / epochs
    return {
        "constant": np.ones(epochs + 1),
        "linear": share,
        "cosine": (1 - np.cos(np.pi * share)) / 2,
        "printed": np.cumprod(share),
    }[decay].tolist()


def moving_average(decay: float) -> Callable[[list[Tensor], list[Tensor], Tensor], None]:
    """Exponential moving average of weights; the decay is at most (1 + n) / (10 + n) at step n."""
    if not 0 < decay < 1:
        raise ValueError(f"ema must lie between 0 and 1; got {decay}")

    @torch.no_grad()
    def average(averaged: list[Tensor], current: list[Tensor], n: Tensor) -> None:
        done = int(n)  # once for all tensors of a type, because a GPU is waited for
        share = min(decay, (1 + done) / (10 + done))
        if averaged[0].is_floating_point():
            torch._foreach_lerp_(averaged, current, 1 - share)
        else:
            torch._foreach_copy_(averaged, current)

    return average


class AtomicCheckpoints(TorchCheckpointIO):
    """Checkpoints written atomically.

    Those of Lightning are written to the folder for temporary files and moved to their place. On
    another file system the move is a copy, and an interruption leaves an incomplete file.

    folder : folder of the training, which lists its files
    """

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    def load_checkpoint(
        self, path: str | Path, map_location: object = None, weights_only: bool | None = True
    ) -> dict[str, object]:
        """Load tensors and plain values only: no code of a file is executed."""
        return super().load_checkpoint(path, weights_only=True)

    def save_checkpoint(
        self, checkpoint: dict[str, object], path: str | Path, storage_options: object = None
    ) -> None:
        """Write a temporary file, then replace the file of an earlier epoch or training."""
        inside = Path(path).resolve().relative_to(self.folder.resolve())
        buffer = BytesIO()  # the writer of torch does not report a full disk
        torch.save(checkpoint, buffer)
        with writing(self.folder) as scratch:
            (scratch / inside).parent.mkdir(parents=True, exist_ok=True)
            (scratch / inside).write_bytes(buffer.getbuffer())
