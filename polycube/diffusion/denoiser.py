"""Denoiser: network and process together, from points of a geometry to points of a polycube."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from polycube.diffusion.classifier import ContextClassifier
from polycube.diffusion.conditions import Condition
from polycube.diffusion.encoding import to_pixels, to_points, x_order
from polycube.diffusion.pairs.templates import Context
from polycube.diffusion.process import DiffusionProcess, Predict

# (predict, x_T, process, generator) -> x_0 (B, 3, h, w) and the recorded states (S, B, 3, h, w)
Sampler = Callable[[Predict, Tensor, DiffusionProcess, torch.Generator], tuple[Tensor, Tensor]]

TARGETS = ("x0", "noise", "v", "move")
AT_ONCE = 8  # images classified at once, whose features fit into the cache: half the time of 72


@contextmanager
def _same_everywhere() -> Iterator[None]:
    """Disable gradients and use one thread, because the order of sums depends on their number.

    A difference of a millionth leads to a different mesh. Two threads would reduce 2.4 s to 2.2 s.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.no_grad():
            yield
    finally:
        torch.set_num_threads(before)


@dataclass(frozen=True)
class DenoiserOptions:
    """Inputs and outputs of a network; the network of the paper has no additional ones."""

    # output of the network: x0, noise, v, or the displacement from geometry to x0
    target: str = "x0"
    geometry_channels: bool = True  # points of the geometry as three additional channels beside x_t
    normals: bool = True  # its unit normals as three more channels
    labels: bool = True  # also predict the polycube face of each point: axis, cell, wall
    classifier: bool = True  # a second network predicts the context; needs a grid
    noise_scale: float = 0.25  # s, in units of the learning frame; 1 in the paper
    pads: bool = False  # single cells have 512 points and zeros, as published

    def __post_init__(self) -> None:
        if self.target not in TARGETS:
            raise ValueError(
                f"denoiser.target must be one of {', '.join(TARGETS)}; got {self.target}"
            )


@dataclass(frozen=True, eq=False)
class Denoised:
    """Positions of points of geometries on their polycubes.

    With a grid, a cell has edge 1 and the origin is at the corner of the grid; otherwise
    coordinates are those of the learning frame.

    log_labels : log-probabilities (B, N, classes) of each label of the condition; empty if the
        network predicts no labels
    """

    points: np.ndarray  # (B, N, 3)
    trajectory: np.ndarray  # (S, B, N, 3) recorded states from x_T to x_0
    log_labels: tuple[np.ndarray, ...] = ()


class Denoiser(nn.Module):
    """A network with its process and its condition.

    network : (channels, outputs, context_length, image) -> module, as made by a model plugin
    condition : a grid and its contexts, or arbitrary structures
    """

    def __init__(
        self,
        network: Callable[[int, int, int, tuple[int, int]], nn.Module],
        alpha_bar: np.ndarray,
        condition: Condition,
        options: DenoiserOptions,
    ) -> None:
        super().__init__()
        self.condition, self.options = condition, options
        self.process = DiffusionProcess(alpha_bar, options.noise_scale)
        self.classes = tuple(condition.labels.values()) if options.labels else ()
        channels = 3 * (1 + options.geometry_channels + options.normals)
        outputs = 3 + sum(self.classes)
        self.network = network(channels, outputs, condition.length, condition.image)
        if options.classifier:
            n_cells, n_primitives = int(np.prod(condition.grid)), len(condition.primitives)
            self.classifier = ContextClassifier(3 * (1 + options.normals), n_cells, n_primitives)

    def forward(self, x_t: Tensor, geometry: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """Outputs of the network for x_t (B, 3, h, w) at steps t (B,): target and label logits.

        geometry : (B, 6, h, w) points and normals, from which the inputs of the network are taken
        """
        seen = [x_t]
        seen += [geometry[:, :3]] if self.options.geometry_channels else []
        seen += [geometry[:, 3:]] if self.options.normals else []
        return self.network(torch.cat(seen, dim=1), t.float() / self.process.steps, context)

    def predict(self, geometry: Tensor, context: Tensor, start: Tensor | None = None) -> Predict:
        """The prediction of x_0 from (x_t, t), for images of a geometry and context vectors.

        start : outputs at t = T for the geometry itself as x_T, if they are known
        """
        q = self.process.adjustment(geometry[:, :3])
        read = {
            "x0": lambda x_t, said, steps: said,
            "noise": lambda x_t, said, steps: self.process.origin(x_t, said, q, steps),
            "v": lambda x_t, said, steps: self.process.origin_of_velocity(x_t, said, q, steps),
            "move": lambda x_t, said, steps: geometry[:, :3] + said,
        }[self.options.target]

        def x_0(x_t: Tensor, t: int) -> Tensor:
            steps = torch.full((len(x_t),), t, device=x_t.device)
            is_start = t == self.process.steps and torch.equal(x_t, geometry[:, :3])
            known = start if is_start else None
            said = self(x_t, geometry, steps, context) if known is None else known
            return read(x_t, said[:, :3].float(), steps)

        return x_0

    def at_start(self, geometry: Tensor, context: Tensor) -> Tensor:
        """Outputs of the network at t = T, where x_T is the geometry."""
        steps = torch.full((len(geometry),), self.process.steps, device=geometry.device)
        return self(geometry[:, :3], geometry, steps, context)

    def log_labels(self, outputs: Tensor) -> tuple[Tensor, ...]:
        """Log-probabilities (B, classes, h, w) of each label of each point."""
        logits = outputs[:, 3:].float().split(self.classes, dim=1)
        return tuple(each.log_softmax(dim=1) for each in logits)

    def n_points(self, told: Any) -> int:
        """Number of sample points of a geometry with this condition."""
        return self.condition.n_points(told, self.options.pads)

    def vectors(self, told: Sequence[Any]) -> Tensor:
        """(B, K) vectors of the conditions; raises LookupError for an unknown primitive."""
        return torch.from_numpy(np.stack([self.condition.vector(each) for each in told]))

    @_same_everywhere()
    def denoise(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        told: Sequence[Any],
        sampler: Sampler,
        seed: int,
        read: float = 1.0,
    ) -> Denoised:
        """Polycube points for points and normals (B, N, 3) of geometries in the learning frame.

        told : for each geometry its context on the grid; without a grid its genus, or None
        read : share of T at which labels are evaluated: 1 uses the geometry only; smaller values
            also use the sample with the noise of that step, so that the labels belong to that
            sample
        """
        self.eval()
        order = x_order(points)
        geometry, context = self._images(points, normals, order), self.vectors(told)
        start = self.at_start(geometry, context)
        predict = self.predict(geometry, context, start)
        draw = torch.Generator().manual_seed(seed)
        x_0, states = sampler(predict, geometry[:, :3], self.process, draw)
        labels: tuple[Tensor, ...] = ()
        if self.classes and read < 1:
            t, z = round(read * self.process.steps), torch.randn(x_0.shape, generator=draw)
            q, step = self.process.adjustment(geometry[:, :3]), torch.full((len(x_0),), t)
            x_t = self.process.forward(x_0, z, q, step)
            labels = self.log_labels(self(x_t, geometry, step, context))
        elif self.classes:
            labels = self.log_labels(start)
        origin = self.condition.origin
        return Denoised(
            to_points(x_0.numpy(), order) + origin,
            np.stack([to_points(s.numpy(), order) for s in states]) + origin,
            tuple(to_points(log_p.numpy(), order) for log_p in labels),
        )

    @_same_everywhere()
    def log_likelihood(
        self, points: np.ndarray, normals: np.ndarray, contexts: Sequence[Context]
    ) -> np.ndarray:
        """(B, C) log-probability that geometries are aligned with the grid and have these contexts.

        points, normals : (B, N, 3) in the learning frame; needs options.classifier

        Of contexts of equal shape only the canonical one is probable (`shapes.turned_contexts`).
        """
        self.eval()
        geometry = self._images(points, normals, x_order(points))
        return self.classifier.log_likelihood(geometry, self.classes_of(contexts)).numpy()

    @_same_everywhere()
    def log_cells(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log-probability of the contents of each cell, and of alignment with the grid.

        points, normals : (B, N, 3) in the learning frame; needs options.classifier

        Returns (B, n_cells, primitives + 1), empty last, and (B,); their sum is `log_likelihood`.
        """
        self.eval()
        geometry = self._images(points, normals, x_order(points))
        few = [self.classifier.log_cells(images) for images in geometry.split(AT_ONCE)]
        log_p, log_along = (torch.cat(each).numpy() for each in zip(*few, strict=True))
        return log_p, log_along

    def classes_of(self, contexts: Sequence[Context]) -> Tensor:
        """(C, n_cells) int64 number of the primitive of each cell; the last number is empty."""
        number = {name: i for i, name in enumerate((*self.condition.primitives, None))}
        return torch.tensor([[number[name] for name in context] for context in contexts])

    def _images(self, points: np.ndarray, normals: np.ndarray, order: np.ndarray) -> Tensor:
        """(B, 6, h, w) images of points and normals."""
        both = [to_pixels(rows, order, self.condition.image) for rows in (points, normals)]
        return torch.from_numpy(np.concatenate(both, axis=1))
