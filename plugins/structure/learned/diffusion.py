"""Denoise the part in the frame of a context, as the paper does, and measure the fit.

The most probable structures according to the classifier are denoised, and the best earlier
candidate of each structure, in its own frame. They are ranked by their probability and by a
residual. The residual consists of the distance between the part and the placed polycube, and of the
differences between the normals of the surface and those of the polycube faces to which its points
are mapped.
"""

from dataclasses import dataclass
from typing import ClassVar

from polycube.kinds import Structure
from polycube.registry import register
from polycube.types import Candidate, Tier, TriMesh

from .options import DenoisingOptions


@register("structure", "diffusion")
@dataclass(frozen=True, kw_only=True, eq=False)
class Diffusion(DenoisingOptions, Structure):
    """Denoise samples of the surface with a trained network, as in the paper, in one step.

    If the user chooses the context, points are denoised in this context.
    """

    references: ClassVar[tuple[str, ...]] = ("ho2020ddpm",)

    tier = Tier.LEARNED
    needs_network = True

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """New structures and better placements of known ones, with trajectories, cheapest first.

        They follow the earlier candidates that were denoised, now with trajectory and probability;
        these share their rough map with the earlier ones. The best of all is always proposed. The
        list is empty if the weights were trained for another grid or other primitives.
        """
        from .denoising import proposed

        return proposed(self, surface, candidates)
