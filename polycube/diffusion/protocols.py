"""The protocols of the plugins of a training, see `polycube.kinds`; does not import torch."""

from __future__ import annotations

from typing import ClassVar, Protocol

import numpy as np


class Schedule(Protocol):
    """Noise schedule."""

    def __call__(self) -> np.ndarray:
        """alpha_bar (T + 1,), decreasing from 1."""


class Model(Protocol):
    """Network: (channels, outputs, context length, image) -> torch module."""

    any_size: ClassVar[bool] = False  # whether images may have any size

    def __call__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> object:
        """A torch module (x (B, channels, h, w), t (B,), context) -> (B, outputs, h, w)."""


class Sampler(Protocol):
    """Reverse diffusion from x_T to x_0, with recorded states for the trajectory."""

    def __call__(self, *args: object, **options: object) -> object:
        """See `polycube.testing.learning` for the arguments and the result."""


class Data(Protocol):
    """Training pairs: an unlimited stream of geometry, polycube, labels and context."""

    pads: bool  # the pixels of empty cells are zeros, as published
    gridless: ClassVar[bool] = False  # pairs without a grid, for grid=any only
    fixed: ClassVar[bool] = False  # the pairs do not depend on the seed

    def __call__(self, *args: object, **options: object) -> object:
        """See `polycube.testing.learning` for the arguments and the result."""

    def held_out(self, *args: object, **options: object) -> object:
        """The pairs on which a training is measured; by default other pairs of the same stream."""
        return self(*args, **options)
