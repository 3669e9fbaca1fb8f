"""Options of proposals by denoising."""

from collections.abc import Mapping
from dataclasses import dataclass

from polycube.registry import choice, setting
from polycube.structure.primitives import OnGrid


@dataclass(frozen=True, kw_only=True, eq=False)
class DenoisingOptions(OnGrid):
    """Selection of structures that are denoised and proposed.

    Parameters
    ----------
    weights : a .ckpt, a .safetensors or a folder of train.py; null: the included weights
    sampler : sampler of x_0
    samples : largest number of candidates of other plugins that are denoised
    tried : largest number of probable structures that are denoised, each in all its proportions
    margin : largest difference in cost from the best one, in cells, of a new structure that is
        proposed
    kept : largest number of new structures
    frames : number of coordinate frames that are tried
    seed : seed of the sample points and the sampler
    """

    weights: str | None = setting("ckpt", None)
    sampler: Mapping[str, object] = choice("sampler", "ddim")
    samples: int = 4
    tried: int = 20
    margin: float = 0.2
    kept: int = 4
    frames: int = 2
    seed: int = setting("seed", 0)
