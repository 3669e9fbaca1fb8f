"""The paper's way: denoise the part in the frame of a context, and see whether it fits.

Denoised are the structures that the network's classifier finds likeliest, and of earlier
candidates the best of each structure, in their own frames.  They are ranked by how likely they are
and by a residual: how far the part and the polycube placed on it are from each other, and how much
the faces that points land on look elsewhere than the surface does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from polycube.kinds import Structure
from polycube.registry import register
from polycube.types import Candidate, TriMesh

from .options import DenoisingOptions


@register("structure", "diffusion")
@dataclass(frozen=True, kw_only=True, eq=False)
class Diffusion(DenoisingOptions, Structure):
    """The paper's method: denoise samples of the surface with a trained network.

    Where the user chooses the context, points are denoised in that context.
    """

    references: ClassVar[tuple[str, ...]] = ("ho2020ddpm",)

    needs_network = True

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """New structures and known ones that are placed better, with trajectories, cheapest first.

        Before these, the earlier candidates that were denoised, with trajectory and probability:
        they share their rough map with the earlier ones.  The best of all is proposed in any case.
        None when the weights do not know the grid or a primitive.
        """
        from .denoising import proposed

        return proposed(self, surface, candidates)
