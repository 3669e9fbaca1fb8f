"""The published method: Algorithm 2 from a part to the polycube of the user's context.

The network of the paper sees the points in the order of x only, and its result is the template of
the context in that order. Therefore the result says nothing about y and z of a single point: each
point of the result is assigned to the point of the part that is next to it, as a whole, when the
boxes of both coincide.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from polycube.errors import InputError
from polycube.kinds import Structure
from polycube.registry import choice, register, setting
from polycube.types import Candidate, Tier, TriMesh

from ..given import Given


@register("structure", "paper")
@dataclass(frozen=True, kw_only=True, eq=False)
class Paper(Given, Structure):
    """The paper's method: denoise the part in the user's context with the published network.

    Parameters
    ----------
    weights : a .ckpt, a .safetensors or a folder of train.py; null: the included weights `paper`
    sampler : sampler of x_0; ddpm is Algorithm 2
    tried : number of placements of the context that are denoised
    seed : seed of the sample points and the sampler
    """

    context: Sequence[str | None] | None = setting("context", ())  # type: ignore[assignment]
    weights: str | None = setting("ckpt", None)
    sampler: Mapping[str, object] = choice("sampler", "ddpm")
    tried: int = 2
    seed: int = setting("seed", 0)

    references: ClassVar[tuple[str, ...]] = ("ho2020ddpm",)

    tier = Tier.LEARNED
    needs_network = True

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first; raises InputError without a context."""
        from polycube.diffusion.weights import SHIPPED

        from .denoising import as_guesses, best_of_each, denoised
        from .hypotheses import denoiser_of_grid

        if not self.context:
            raise InputError("structure=paper needs a context, such as context=[cube,hole_z]")
        weights = self.weights or str(SHIPPED / "paper")
        denoiser = denoiser_of_grid(weights, self.grid, self.primitives)
        if denoiser is None:
            return []
        placed = best_of_each(super().__call__(surface, candidates))[: self.tried]
        given = as_guesses(placed), self.primitives, self.sampler, self.seed
        return best_of_each(denoised(denoiser, surface, *given, proposal="paper", assigns=True))
