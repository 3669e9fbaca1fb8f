"""Denoise the part in the frame of a context, as the paper does, and measure the fit.

The most probable structures according to the classifier are denoised, and the best earlier
candidate of each structure, in its own frame. They are ranked by their probability and by a
residual. The residual consists of the distance between the part and the placed polycube, and of the
differences between the normals of the surface and those of the polycube faces to which its points
are mapped.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from polycube.kinds import Structure
from polycube.registry import choice, register, setting
from polycube.structure.primitives import OnGrid
from polycube.types import Candidate, Tier, TriMesh

logger = logging.getLogger(__name__)

N_COMPARED = 2000  # points of a part at which two rough maps are compared


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
        from .denoising import as_guesses, best_of_each, denoised, is_nearer
        from .hypotheses import UNLIKELY, denoiser_of_grid, guesses, sample

        denoiser = denoiser_of_grid(self.weights, self.grid, self.primitives)
        if denoiser is None:
            return []
        probable = guesses(denoiser, surface, self.primitives, self.frames, self.seed)
        same_grid = [c for c in candidates if tuple(c.polycube.grid) == tuple(self.grid)]
        earlier = best_of_each(same_grid)
        is_given = any(candidate.proposal == "given" for candidate in candidates)
        # the cost is within the margin if all residuals are equal
        least = probable[0].log_likelihood - self.margin / UNLIKELY if probable else 0.0
        likely = [guess for guess in probable[: self.tried] if guess.log_likelihood >= least]
        tried = likely * (not is_given) + as_guesses(earlier[: self.samples], probable)
        how = self.primitives, self.sampler, self.seed
        found = best_of_each(denoised(denoiser, surface, tried, *how))
        close = [c for c in found if c.cost <= found[0].cost + self.margin]
        earlier_of = {candidate.key: candidate for candidate in earlier}
        updated = []  # earlier candidates with the trajectory and the probability of the new ones
        for c in found:
            if c.key in earlier_of:
                old, p = earlier_of[c.key], c.probability
                updated.append(replace(old, trajectory=c.trajectory, steps=c.steps, probability=p))
        new = [c for c in close if c.key not in earlier_of][: self.kept]
        points, _ = sample(surface, N_COMPARED, np.random.default_rng(self.seed))
        again = [(c, earlier_of[c.key]) for c in close if c.key in earlier_of]
        better_placed = [c for c, old in again if c is found[0] or is_nearer(c, old, points)]
        costs = ", ".join(f"{candidate.cost:.3f}" for candidate in new + better_placed) or "none"
        message = "diffusion: %d structures denoised; %d new, %d with a better placement; cost %s"
        logger.info(message, len(found), len(new), len(better_placed), costs)
        return updated + sorted(new + better_placed, key=lambda candidate: candidate.cost)
