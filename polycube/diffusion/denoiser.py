"""Denoiser: network and process together, from points of a geometry to points of a polycube."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from torch import Tensor, nn

from polycube.diffusion.conditions import Condition
from polycube.diffusion.encoding import by_x, learning_frame, to_pixels, to_points
from polycube.diffusion.point_network import ContextClassifier
from polycube.diffusion.process import DiffusionProcess, Predict
from polycube.types import Frame
from polycube.types.options import Options, Positive

# (predict, x_T, process, generator) -> x_0 (B, 3, h, w) and the recorded states (S, B, 3, h, w)
Sampler = Callable[[Predict, Tensor, DiffusionProcess, torch.Generator], tuple[Tensor, Tensor]]

# images classified at once: their features fit into the cache, which halves the time of 72 images
CLASSIFIER_BATCH = 8


@contextmanager
def _reproducible() -> Iterator[None]:
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
class DenoiserOptions(Options):
    """Inputs and outputs of a network; the network of the paper has no additional ones."""

    group = "denoiser."

    # output of the network: x0, noise, v, or the displacement from geometry to x0
    target: Literal["x0", "noise", "v", "move"] = "x0"
    geometry_channels: bool = True  # points of the geometry as three channels in addition to x_t
    normals: bool = True  # its unit normals as three more channels
    labels: bool = True  # also predict the polycube face of each point: axis, cell, wall
    classifier: bool = True  # a second network predicts the context; needs a grid
    noise_scale: Positive = 0.25  # s, in units of the learning frame; 1 in the paper
    # as published: a geometry fills the box of its cells, and the pixels of empty cells are zeros
    pads: bool = False


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
        self.network = network(channels, 3 + sum(self.classes), condition.length, condition.image)
        if options.classifier:
            n_cells, n_primitives = int(np.prod(condition.grid)), len(condition.primitives)
            self.classifier = ContextClassifier(3 * (1 + options.normals), n_cells, n_primitives)

    def forward(self, x_t: Tensor, geometry: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """Outputs of the network for x_t (B, 3, h, w) at steps t (B,): target and label logits.

        geometry : (B, 6, h, w) points and normals, from which the inputs of the network are taken
        """
        inputs = [x_t]
        inputs += [geometry[:, :3]] if self.options.geometry_channels else []
        inputs += [geometry[:, 3:]] if self.options.normals else []
        return self.network(torch.cat(inputs, dim=1), t.float() / self.process.steps, context)

    def predict(self, geometry: Tensor, context: Tensor, start: Tensor | None = None) -> Predict:
        """The prediction of x_0 from (x_t, t), for images of a geometry and context vectors.

        start : outputs at t = T for the geometry itself as x_T, if they were computed before
        """
        q = self.process.adjustment(geometry[:, :3])
        to_x_0 = {
            "x0": lambda x_t, outputs, steps: outputs,
            "noise": lambda x_t, outputs, steps: self.process.origin(x_t, outputs, q, steps),
            "v": lambda x_t, outputs, steps: self.process.origin_of_velocity(
                x_t, outputs, q, steps
            ),
            "move": lambda x_t, outputs, steps: geometry[:, :3] + outputs,
        }[self.options.target]

        def x_0(x_t: Tensor, t: int) -> Tensor:
            steps = torch.full((len(x_t),), t, device=x_t.device)
            is_start = t == self.process.steps and torch.equal(x_t, geometry[:, :3])
            stored = start if is_start else None
            outputs = self(x_t, geometry, steps, context) if stored is None else stored
            return to_x_0(x_t, outputs[:, :3].float(), steps)

        return x_0

    def at_start(self, geometry: Tensor, context: Tensor) -> Tensor:
        """Outputs of the network at t = T, where x_T is the geometry."""
        steps = torch.full((len(geometry),), self.process.steps, device=geometry.device)
        return self(geometry[:, :3], geometry, steps, context)

    def log_labels(self, outputs: Tensor) -> tuple[Tensor, ...]:
        """Log-probabilities (B, classes, h, w) of each label of each point."""
        logits = outputs[:, 3:].float().split(self.classes, dim=1)
        return tuple(each.log_softmax(dim=1) for each in logits)

    def pixels(self, value: Any) -> np.ndarray:
        """(N,) pixels of the sample points of a geometry with this value of the condition."""
        return self.condition.pixels(value, self.options.pads)

    def frame(self, vertices: np.ndarray, rotation: np.ndarray, value: Any) -> Frame:
        """Frame in which the network sees a part with vertices (V, 3) in an orientation (3, 3)."""
        return learning_frame(vertices, rotation, self.condition.box(value, self.options.pads))

    def vectors(self, values: Sequence[Any]) -> Tensor:
        """(B, K) vectors of values; raises LookupError for an unknown primitive."""
        own = np.stack([self.condition.vector(value) for value in values])
        return torch.from_numpy(own).to(self.device)

    @property
    def device(self) -> torch.device:
        """Where the network is, and where it computes."""
        return next(self.parameters(), torch.empty(0)).device

    @_reproducible()
    def denoise(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        condition_values: Sequence[Any],
        sampler: Sampler,
        seed: int,
        label_time: float = 1.0,
    ) -> Denoised:
        """Polycube points for points and normals (B, N, 3) of geometries in their `frame`.

        condition_values : for each geometry its context on the grid; without a grid its genus, or
            None
        label_time : share of T at which labels are evaluated: 1 uses the geometry only; smaller
            values also use the sample with the noise of that step, so that the labels belong to
            that sample
        """
        self.eval()
        at = by_x(points, np.stack([self.pixels(value) for value in condition_values]))
        geometry = self._images(points, normals, at)
        context = self.vectors(condition_values)
        start = self.at_start(geometry, context)
        predict = self.predict(geometry, context, start)
        draw = torch.Generator().manual_seed(seed)
        x_0, states = sampler(predict, geometry[:, :3], self.process, draw)
        labels: tuple[Tensor, ...] = ()
        if self.classes and label_time < 1:
            t = round(label_time * self.process.steps)
            z = torch.randn(x_0.shape, generator=draw).to(x_0)
            step = torch.full((len(x_0),), t, device=self.device)
            x_t = self.process.forward(x_0, z, self.process.adjustment(geometry[:, :3]), step)
            labels = self.log_labels(self(x_t, geometry, step, context))
        elif self.classes:
            labels = self.log_labels(start)
        origin = self.condition.origin
        return Denoised(
            to_points(x_0.numpy(force=True), at) + origin,
            np.stack([to_points(s.numpy(force=True), at) for s in states]) + origin,
            tuple(to_points(log_p.numpy(force=True), at) for log_p in labels),
        )

    @_reproducible()
    def log_cells(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log-probability of the contents of each cell, and of alignment with the grid.

        points, normals : (B, N, 3) in the learning frame; needs options.classifier

        Returns (B, n_cells, primitives + 1), empty last, and (B,); the sum over the cells of a
        context and the alignment is the log-probability of this context. Of contexts of equal shape
        only the canonical one is probable (`templates.turned_contexts`).
        """
        self.eval()
        geometry = self._images(points, normals, by_x(points))
        batches = [self.classifier.log_cells(images) for images in geometry.split(CLASSIFIER_BATCH)]
        log_p, log_aligned = map(torch.cat, zip(*batches, strict=True))
        return log_p.numpy(force=True), log_aligned.numpy(force=True)

    def _images(self, points: np.ndarray, normals: np.ndarray, at: np.ndarray) -> Tensor:
        """(B, 6, h, w) images of points and normals."""
        both = [to_pixels(rows, at, self.condition.image) for rows in (points, normals)]
        return torch.from_numpy(np.concatenate(both, axis=1)).to(self.device)
