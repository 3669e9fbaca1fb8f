"""Options of the proposals that denoise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycube.registry import choice, setting


@dataclass(frozen=True, kw_only=True, eq=False)
class DenoisingOptions:
    """What is denoised, and how much of it is proposed.

    Parameters
    ----------
    grid : cells of the polycube along x, y, z
    primitives : (3, 3, 3) bool voxels by name
    weights : .ckpt, .safetensors or folder that train.py writes; null: the shipped weights
    sampler : how x_0 is sampled
    samples : candidates of other plugins that are denoised at most
    tried : likely structures, each in all its proportions, that are denoised at most
    margin : cost above the best, in cells, up to which a new structure is proposed
    kept : new structures proposed at most
    frames : coordinate frames tried
    seed : of the sample points and the sampler
    """

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    weights: str | None = setting("ckpt", None)
    sampler: Mapping[str, object] = choice("sampler", "ddim")
    samples: int = 4
    tried: int = 20
    margin: float = 0.2
    kept: int = 4
    frames: int = 2
    seed: int = setting("seed", 0)
