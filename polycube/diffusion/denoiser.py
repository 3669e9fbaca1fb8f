"""The trained half: network and process together, from geometry points to polycube points."""

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

# (predict, x_T, process, generator) -> x_0 (B, 3, h, w) and the kept states (S, B, 3, h, w)
Sampler = Callable[[Predict, Tensor, DiffusionProcess, torch.Generator], tuple[Tensor, Tensor]]

TARGETS = ("x0", "noise", "v", "move")


@contextmanager
def _same_everywhere() -> Iterator[None]:
    """Without gradients and on one thread: sums come in an order that depends on their number.

    What differs by a millionth becomes another mesh.  Two threads would take 2.2 s for 2.4 s.
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
    """What a network was trained to see and to say; the paper's has none of the additions."""

    target: str = "x0"  # what the network predicts: x0, noise, v, or the move from geometry to x0
    geometry_channels: bool = True  # the geometry's points beside x_t as three more channels
    normals: bool = True  # and its unit normals as three more
    labels: bool = True  # also says of each point its polycube face: axis, cell, wall
    classifier: bool = True  # a second network says the context; needs a grid
    noise_scale: float = 0.25  # s, in learning-frame units; the paper has 1
    pads: bool = False  # single cells have 512 points and zeros, as published

    def __post_init__(self) -> None:
        if self.target not in TARGETS:
            raise ValueError(
                f"denoiser.target must be one of {', '.join(TARGETS)}; got {self.target}"
            )


@dataclass(frozen=True, eq=False)
class Denoised:
    """Where points of geometries lie on their polycubes.

    On a grid a cell has edge 1 and the origin is at the grid's corner; else this is the learning
    frame.

    log_labels : log-probabilities (B, N, classes) of each of the labels of the condition; none if
        the network says no labels
    """

    points: np.ndarray  # (B, N, 3)
    trajectory: np.ndarray  # (S, B, N, 3) kept states from x_T to x_0
    log_labels: tuple[np.ndarray, ...] = ()


class Denoiser(nn.Module):
    """A network with its process and what it knows of structures.

    network : (channels, outputs, context_length, image) -> module, as a model plugin makes it
    condition : a grid and its contexts, or any structure
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
        """What the network says about x_t (B, 3, h, w) at steps t (B,): target and label logits.

        geometry : (B, 6, h, w) points and normals of which it sees what it was trained to see
        """
        seen = [x_t]
        seen += [geometry[:, :3]] if self.options.geometry_channels else []
        seen += [geometry[:, 3:]] if self.options.normals else []
        return self.network(torch.cat(seen, dim=1), t.float() / self.process.steps, context)

    def predict(self, geometry: Tensor, context: Tensor) -> Predict:
        """x_0 predicted from (x_t, t) for images of a geometry and their context vectors."""
        q = self.process.adjustment(geometry[:, :3])
        read = {
            "x0": lambda x_t, said, steps: said,
            "noise": lambda x_t, said, steps: self.process.origin(x_t, said, q, steps),
            "v": lambda x_t, said, steps: self.process.origin_of_velocity(x_t, said, q, steps),
            "move": lambda x_t, said, steps: geometry[:, :3] + said,
        }[self.options.target]

        def x_0(x_t: Tensor, t: int) -> Tensor:
            steps = torch.full((len(x_t),), t, device=x_t.device)
            return read(x_t, self(x_t, geometry, steps, context)[:, :3].float(), steps)

        return x_0

    def log_labels(
        self, geometry: Tensor, context: Tensor, x_t: Tensor | None = None, t: int | None = None
    ) -> tuple[Tensor, ...]:
        """Log-probabilities (B, classes, h, w) of each label of each point, by default at t = T."""
        x_t = geometry[:, :3] if x_t is None else x_t
        t = self.process.steps if t is None else t
        steps = torch.full((len(geometry),), t, device=geometry.device)
        said = self(x_t, geometry, steps, context)[:, 3:].float()
        return tuple(logits.log_softmax(dim=1) for logits in said.split(self.classes, dim=1))

    def n_points(self, told: Any) -> int:
        """Sample points of a geometry of which this is told."""
        return self.condition.n_points(told, self.options.pads)

    def vectors(self, told: Sequence[Any]) -> Tensor:
        """(B, K) vectors of what is told; raises LookupError for a primitive not trained."""
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
        """Polycube points for (B, N, 3) points and normals of geometries in the learning frame.

        told : of each geometry its context on the grid; without a grid its genus, or None
        read : share of T at which labels are read: 1 sees the geometry only, a smaller one sees
            the sample as well, with the noise of that step, so that labels are of that sample
        """
        self.eval()
        order = x_order(points)
        geometry, context = self._images(points, normals, order), self.vectors(told)
        predict = self.predict(geometry, context)
        draw = torch.Generator().manual_seed(seed)
        x_0, states = sampler(predict, geometry[:, :3], self.process, draw)
        labels: tuple[Tensor, ...] = ()
        if self.classes and read < 1:
            t, z = round(read * self.process.steps), torch.randn(x_0.shape, generator=draw)
            q, step = self.process.adjustment(geometry[:, :3]), torch.full((len(x_0),), t)
            x_t = self.process.forward(x_0, z, q, step)
            labels = self.log_labels(geometry, context, x_t, t)
        elif self.classes:
            labels = self.log_labels(geometry, context)
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
        """(B, C) log-probability that geometries lie along the grid and have these contexts.

        points, normals : (B, N, 3) in the learning frame; needs options.classifier.
        Of contexts of equal shape only the canonical one is likely (`shapes.turned_contexts`).
        """
        self.eval()
        geometry = self._images(points, normals, x_order(points))
        return self.classifier.log_likelihood(geometry, self.classes_of(contexts)).numpy()

    @_same_everywhere()
    def log_cells(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log-probability of what fills each cell, and of the geometry lying along the grid.

        points, normals : (B, N, 3) in the learning frame; needs options.classifier.
        (B, n_cells, primitives + 1), empty last, and (B,); their sum is `log_likelihood`
        """
        self.eval()
        geometry = self._images(points, normals, x_order(points))
        log_p, log_along = self.classifier.log_cells(geometry)
        return log_p.numpy(), log_along.numpy()

    def classes_of(self, contexts: Sequence[Context]) -> Tensor:
        """(C, n_cells) int64 number of each cell's primitive; that of empty comes last."""
        number = {name: i for i, name in enumerate((*self.condition.primitives, None))}
        return torch.tensor([[number[name] for name in context] for context in contexts])

    def _images(self, points: np.ndarray, normals: np.ndarray, order: np.ndarray) -> Tensor:
        """(B, 6, h, w)"""
        both = [to_pixels(rows, order, self.condition.image) for rows in (points, normals)]
        return torch.from_numpy(np.concatenate(both, axis=1))
