"""Training (paper, Algorithm 1) as a LightningModule."""

import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial, reduce
from math import ceil
from typing import Any

import lightning.pytorch as L
import numpy as np
import torch
from lightning.pytorch.utilities.types import OptimizerLRSchedulerConfig
from torch import Tensor, distributed
from torch.nn import functional
from torch.optim import Optimizer
from torch.optim.lr_scheduler import LambdaLR

from polycube.diffusion.denoiser import Denoiser, Sampler
from polycube.diffusion.pairs.templates import IDENTITY
from polycube.diffusion.training.data_module import Batch, rank_and_processes
from polycube.diffusion.training.draws import Draws, draws
from polycube.diffusion.training.learning import Learning, rate_factors
from polycube.diffusion.weights import Recipe
from polycube.surface.frames import rotations

SOFT = 0.01  # distance up to which the loss grows quadratically
ROTATIONS = torch.tensor(rotations(), dtype=torch.float32)  # (24, 3, 3)


def of_all_processes(values: Tensor) -> Tensor:
    """(N,) values of this process together with those of all other processes."""
    _, processes = rank_and_processes()
    if processes == 1:
        return values
    gathered: list[Tensor] = [values] * processes
    distributed.all_gather_object(gathered, values.cpu())
    return torch.cat(gathered).to(values.device)


class DDPMPolycube(L.LightningModule):
    """Learns to predict x_0 (or noise, or v) from x_t; validated by sampling held-out geometries.

    config : plain dictionary with everything needed to build the same denoiser, stored in
        checkpoints
    turned : (C, 24, n_cells) target of the classifier for pair i in each orientation, at i %
        C (`shapes.turned_contexts`); not needed without a classifier
    optimizer : (parameters, lr) -> optimizer
    """

    def __init__(
        self,
        denoiser: Denoiser,
        learning: Learning,
        sampler: Sampler,
        config: Recipe,
        turned: np.ndarray | None = None,
        optimizer: Callable[..., Optimizer] = torch.optim.Adam,
    ) -> None:
        super().__init__()
        self.save_hyperparameters("config")
        self.denoiser, self.learning, self.sampler = denoiser, learning, sampler
        self.optimizer = optimizer
        self.turned = None if turned is None else torch.from_numpy(turned)
        self.steps_done, self.pairs_done = 0, 0  # pairs of all processes
        self._started, self._pairs_before = time.perf_counter(), 0
        self._measured: dict[str, list[Tensor]] = defaultdict(list)
        self.example: tuple[Tensor, Tensor, Tensor] | None = None  # geometry, x_0, truth

    def setup(self, stage: str) -> None:
        """Let a GPU use TF32 in single precision."""
        if torch.cuda.is_available():
            torch.set_float32_matmul_precision("high")

    def draws(self, numbers: Tensor, image: tuple[int, int]) -> Draws:
        """Random values for images of the given size, for the pairs with these numbers (B,)."""
        steps, endpoint = self.denoiser.process.steps, self.learning.endpoint
        return draws(self.learning.seed, numbers, steps, endpoint, image)

    def loss(self, batch: Batch) -> dict[str, Tensor]:
        """Terms of the loss: the prediction at random steps (eq. 10), its labels, the context.

        A share of the batch is trained at the start of sampling: t = T, x_T = the geometry.
        """
        thin = self.learning.thin
        images = batch.geometry, batch.polycube, batch.labels
        geometry, x_0, labels = (image[..., ::thin, ::thin] for image in images)
        process, x_T = self.denoiser.process, geometry[:, :3]
        height, width = x_0.shape[2:]
        t, first, turn, z = self.draws(batch.number, (height, width))
        q = process.adjustment(x_T)
        x_t = process.forward(x_0, z, q, t)
        t = torch.where(first, process.steps, t)
        x_t = torch.where(first[:, None, None, None], x_T, x_t)
        outputs = self.denoiser(x_t, geometry, t, batch.context).float()
        target = {
            "x0": lambda: x_0,
            "noise": lambda: process.noise(x_t, x_0, q, t),
            "v": lambda: process.velocity(x_0, process.noise(x_t, x_0, q, t), t),
            "move": lambda: x_0 - x_T,
        }[self.denoiser.options.target]()
        terms = {"points": self._distance(outputs[:, :3], target, labels[:, 0] >= 0)}
        if self.denoiser.classes:
            logits = outputs[:, 3:].split(self.denoiser.classes, dim=1)
            entropy = partial(functional.cross_entropy, ignore_index=-1)
            entropies = map(entropy, logits, labels.unbind(dim=1))
            terms["labels"] = self.learning.labels * reduce(torch.add, entropies)
        if self.turned is not None:
            cells = _contexts(self.turned, batch.number, turn)
            terms["context"] = self._context_loss(geometry, turn, cells)
        return terms

    def _distance(self, outputs: Tensor, target: Tensor, real: Tensor) -> Tensor:
        """Loss of predictions (B, 3, h, w); real (B, h, w) is False in padding."""
        if self.learning.loss == "mse":
            return functional.mse_loss(outputs, target)
        return (((outputs - target).square().sum(dim=1) + SOFT**2).sqrt() - SOFT)[real].mean()

    def _context_loss(self, geometry: Tensor, turn: Tensor, target: Tensor) -> Tensor:
        """Cross-entropies of the alignment of rotated geometries, and of the cells of aligned ones.

        target : (B, cells) see `_contexts`
        """
        vectors = geometry.unflatten(1, (2, 3))  # points and normals
        vectors = torch.einsum("bij,bkjhw->bkihw", ROTATIONS.to(geometry)[turn], vectors)
        cells, alignment = self.denoiser.classifier(vectors.flatten(1, 2))
        is_aligned = (target[:, 0] >= 0).float()
        logits = cells.float().transpose(1, 2)
        filled = functional.cross_entropy(logits, target, ignore_index=-1, reduction="none")
        aligned = functional.binary_cross_entropy_with_logits(alignment.float(), is_aligned)
        return filled.mean() + aligned

    def training_step(self, batch: Batch, index: int) -> Tensor:
        """Loss of one batch."""
        terms = self.loss(batch)
        loss = reduce(torch.add, terms.values())
        self.pairs_done += len(batch.geometry) * self.trainer.world_size
        self.steps_done = self.global_step + 1
        self.log("loss", loss, prog_bar=True, sync_dist=True)
        self.log_dict({f"loss/{name}": term for name, term in terms.items()}, sync_dist=True)
        self.log("lr", self.trainer.optimizers[0].param_groups[0]["lr"])
        return loss

    def on_save_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Store the progress of the training."""
        checkpoint["pairs_done"] = self.pairs_done

    def on_load_checkpoint(self, checkpoint: dict[str, Any]) -> None:
        """Restore the progress of the training."""
        self.steps_done = checkpoint["global_step"]
        self.pairs_done = checkpoint.get("pairs_done", 0)

    def on_train_epoch_start(self) -> None:
        """Start measuring samples per second."""
        self._started, self._pairs_before = time.perf_counter(), self.pairs_done

    def on_train_epoch_end(self) -> None:
        """Log samples per second."""
        speed = (self.pairs_done - self._pairs_before) / (time.perf_counter() - self._started)
        self.log("samples_per_second", speed, prog_bar=True, sync_dist=True)

    def validation_step(self, batch: Batch, index: int) -> None:
        """Distances of sampled points from the truth, and accuracy of labels and contexts."""
        example = self._measure(batch)
        if index == 0:
            self.example = example

    def test_step(self, batch: Batch, index: int) -> None:
        """The same for pairs that did not choose the checkpoint."""
        self._measure(batch)

    def _measure(self, batch: Batch) -> tuple[Tensor, Tensor, Tensor]:
        """Collect the measurements of a batch; returns its geometry, samples and truth."""
        geometry, truth = batch.geometry, batch.polycube
        generator = torch.Generator().manual_seed(self.learning.seed)
        start, x_T = self.denoiser.at_start(geometry, batch.context), geometry[:, :3]
        predict = self.denoiser.predict(geometry, batch.context, start)
        first = predict(x_T, self.denoiser.process.steps)
        x_0, _ = self.sampler(predict, x_T, self.denoiser.process, generator)
        real = batch.labels[:, 0] >= 0  # (B, h, w), False in padding
        for name, x in {"error": x_0, "error/one_step": first, "error/untouched": x_T}.items():
            self._measured[name].append((x - truth).norm(dim=1)[real].float())
        if self.denoiser.classes:
            log_p = self.denoiser.log_labels(start)
            for i, name in enumerate(self.denoiser.condition.labels):
                right = log_p[i].argmax(dim=1) == batch.labels[:, i]
                self._measured[f"right/{name}"].append(right[real].float())
        if self.turned is not None:
            cells, _ = self.denoiser.classifier(geometry)
            right = cells.argmax(dim=2) == _contexts(self.turned, batch.number, IDENTITY)
            self._measured["right/context"].append(right.all(dim=1).float())
        return x_T.cpu(), x_0.cpu(), truth.cpu()

    def on_validation_epoch_end(self) -> None:
        """Log means over all processes, and the 95th percentile of the distance."""
        self._log_measured("")

    def on_test_epoch_end(self) -> None:
        """The same, with test/ before each name."""
        self._log_measured("test/")

    def _log_measured(self, before: str) -> None:
        for name, parts in self._measured.items():
            values = of_all_processes(torch.cat(parts))
            self.log(before + name, values.mean(), prog_bar=name == "error", sync_dist=True)
            if name == "error":
                p95 = values.kthvalue(max(1, int(0.95 * len(values))))[0]
                self.log(f"{before}error/p95", p95, sync_dist=True)
        self._measured.clear()

    def configure_optimizers(self) -> OptimizerLRSchedulerConfig:
        """The optimizer, with a rate for each epoch that rises over the first batches."""
        most, trainer = self.trainer.max_epochs or -1, self.trainer
        trainer.fit_loop.setup_data()  # for the number of batches
        steps = ceil(trainer.num_training_batches / trainer.accumulate_grad_batches)  # of an epoch
        factors = rate_factors(self.learning.decay, most) if most > 0 else [1.0]

        def factor(step: int) -> float:
            risen = min(1.0, (step + 1) / (self.learning.warmup + 1))
            return risen * factors[min(step // steps, len(factors) - 1)]

        optimizer = self.optimizer(self.parameters(), lr=self.learning.rate)
        schedule = LambdaLR(optimizer, factor)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}


def _contexts(turned: Tensor, number: Tensor, turn: Tensor | int) -> Tensor:
    """(B, cells) target of the classifier for rotated pairs; -1 if there is none."""
    turned = turned.to(number.device)
    return turned[number % len(turned), turn]
