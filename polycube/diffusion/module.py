"""Training (paper, Algorithm 1) as a LightningModule."""

from __future__ import annotations

import time
from collections import defaultdict
from dataclasses import dataclass

import lightning.pytorch as L
import torch
from torch import Tensor
from torch.optim import Optimizer
from torch.optim.lr_scheduler import LambdaLR

from polycube.diffusion.dataset import Batch
from polycube.diffusion.denoiser import Denoiser, Sampler

DECAYS = ("constant", "linear", "paper")


@dataclass(frozen=True)
class Learning:
    """How to train."""

    rate: float = 1e-3  # Adam's learning rate at the start
    decay: str = "linear"  # of the rate over the epochs: constant, linear or paper
    endpoint: float = 0.8  # share of a batch trained at t = T from the geometry itself
    thin: int = 1  # train on every n-th row and column; 1 where the network needs whole images
    seed: int = 0

    def __post_init__(self) -> None:
        if self.thin < 1:
            raise ValueError(f"learning.thin must be at least 1; got {self.thin}")
        if self.decay not in DECAYS:
            raise ValueError(f"learning.decay must be one of {', '.join(DECAYS)}; got {self.decay}")
        if not 0 <= self.endpoint <= 1:
            raise ValueError(f"learning.endpoint must lie in [0, 1]; got {self.endpoint}")


def rate_factors(decay: str, epochs: int) -> list[float]:
    """Learning rate of each epoch k = 0..K as a share of the first.

    paper: eta_k = eta_{k-1} (1 - k / K); linear: eta_k = eta_0 (1 - k / K)
    """
    factors = [1.0]
    for k in range(1, epochs + 1):
        share = 1 - k / epochs
        factors.append({"constant": 1.0, "linear": share, "paper": factors[-1] * share}[decay])
    return factors


class DDPMPolycube(L.LightningModule):
    """Learns to predict x_0 (or the noise) from x_t; measured by sampling held-out geometries.

    config : everything needed to build the same denoiser again, plain dict, kept in checkpoints
    """

    def __init__(
        self, denoiser: Denoiser, learning: Learning, sampler: Sampler, config: dict[str, object]
    ) -> None:
        super().__init__()
        self.save_hyperparameters({"config": config})
        self.denoiser, self.learning, self.sampler = denoiser, learning, sampler
        self.steps_done = 0
        self._started, self._seen = time.perf_counter(), 0
        self._distances: dict[str, list[Tensor]] = defaultdict(list)
        self.example: tuple[Tensor, Tensor, Tensor] | None = None  # geometry, x_0, truth

    def loss(self, batch: Batch, generator: torch.Generator) -> Tensor:
        """Mean squared error of the prediction at random steps (eq. 4).

        A share of the batch is trained where sampling starts: t = T, x_T = the geometry.
        """
        geometry, x_0 = (
            image[..., :: self.learning.thin, :: self.learning.thin] for image in batch[:2]
        )
        context = batch[2]
        process, n = self.denoiser.process, len(x_0)
        t = torch.randint(1, process.steps + 1, (n,), generator=generator).to(x_0.device)
        z = torch.randn(x_0.shape, generator=generator).to(x_0)
        q = process.adjustment(geometry)
        x_t = process.forward(x_0, z, q, t)
        first = (torch.rand(n, generator=generator) < self.learning.endpoint).to(x_0.device)
        t = torch.where(first, process.steps, t)
        x_t = torch.where(first[:, None, None, None], geometry, x_t)
        said = self.denoiser(x_t, geometry, t, context)
        wanted = x_0 if self.denoiser.options.target == "x0" else process.noise(x_t, x_0, q, t)
        return torch.nn.functional.mse_loss(said.float(), wanted)

    def training_step(self, batch: Batch, index: int) -> Tensor:
        """Loss of one batch; steps and noise depend on the seed and the step alone."""
        generator = torch.Generator().manual_seed(self.learning.seed + self.global_step)
        loss = self.loss(batch, generator)
        self._seen += len(batch[0])
        self.steps_done = self.global_step + 1
        self.log("loss", loss, prog_bar=True)
        self.log("lr", self.trainer.optimizers[0].param_groups[0]["lr"])
        return loss

    def on_load_checkpoint(self, checkpoint: dict[str, object]) -> None:
        """Remember how far a training had come, also where it is not continued."""
        self.steps_done = checkpoint["global_step"]

    def on_train_epoch_start(self) -> None:
        """Start counting samples per second."""
        self._started, self._seen = time.perf_counter(), 0

    def on_train_epoch_end(self) -> None:
        """Log samples per second."""
        speed = self._seen / (time.perf_counter() - self._started)
        self.log("samples_per_second", speed, prog_bar=True)

    def validation_step(self, batch: Batch, index: int) -> None:
        """Distances, in cells, of sampled points from where they should be."""
        geometry, truth, context = batch
        generator = torch.Generator().manual_seed(self.learning.seed)
        predict = self.denoiser.predict(geometry, context)
        first = predict(geometry, self.denoiser.process.steps)
        x_0, _ = self.sampler(predict, geometry, self.denoiser.process, generator)
        real = geometry.abs().sum(dim=1) > 0  # (B, h, w), False where padded
        for name, x in {"error": x_0, "error_one_step": first, "error_untouched": geometry}.items():
            self._distances[name].append((x - truth).norm(dim=1)[real].float())
        if index == 0:
            self.example = (geometry.cpu(), x_0.cpu(), truth.cpu())

    def on_validation_epoch_end(self) -> None:
        """Log the mean distances, and the one that 95 % of the sampled points stay under."""
        for name, parts in self._distances.items():
            distance = torch.cat(parts)
            self.log(name, distance.mean(), prog_bar=name == "error")
            if name == "error":
                self.log("error_p95", distance.kthvalue(max(1, int(0.95 * len(distance))))[0])
        self._distances.clear()

    def configure_optimizers(self) -> tuple[list[Optimizer], list[LambdaLR]]:
        """Adam, its rate set at every epoch."""
        adam = torch.optim.Adam(self.parameters(), lr=self.learning.rate)
        factors = rate_factors(self.learning.decay, max(self.trainer.max_epochs, 1))
        rate = LambdaLR(adam, lambda epoch: factors[min(epoch, len(factors) - 1)])
        return [adam], [rate]
