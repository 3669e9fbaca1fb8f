"""Denoise the part in the frame of a context, as the paper does, and measure the fit.

The most probable structures according to the classifier are denoised, and the best earlier
candidate of each structure, in its own frame. They are ranked by their probability and by a
residual. The residual consists of the distance between the part and the placed polycube, and of the
differences between the normals of the surface and those of the polycube faces to which its points
are mapped.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from polycube.kinds import Structure
from polycube.registry import choice, register, setting
from polycube.structure.primitives import OnGrid
from polycube.types import Candidate, Tier, TriMesh


@register("structure", "diffusion")
@dataclass(frozen=True, kw_only=True, eq=False)
class Diffusion(OnGrid, Structure):
    """Denoise samples of the surface with a trained network, as in the paper, in one step.

    If the user chooses the context, points are denoised in this context.

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

    references: ClassVar[tuple[str, ...]] = ("ho2020ddpm",)

    tier = Tier.LEARNED
    needs_network = True

    weights: str | None = setting("ckpt", None)
    sampler: Mapping[str, object] = choice("sampler", "ddim")
    samples: int = 4
    tried: int = 20
    margin: float = 0.2
    kept: int = 4
    frames: int = 2
    seed: int = setting("seed", 0)

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """New structures and better placements of known ones, with trajectories, cheapest first.

        They follow the earlier candidates that were denoised, now with trajectory and probability;
        these share their rough map with the earlier ones. The best of all is always proposed. The
        list is empty if the weights were trained for another grid or other primitives.
        """
        from .denoising import proposed

        return proposed(self, surface, candidates)
