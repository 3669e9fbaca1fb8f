"""Structure by classification only, as in DL-Polycube: predict the type without diffusion.

The most probable polycubes according to the trained classifier are stretched to the bounding box of
the part, each in the proportions closest to those of the part.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.errors import InputError
from polycube.kinds import Structure
from polycube.registry import register, setting
from polycube.types import Candidate, TriMesh

if TYPE_CHECKING:
    from .hypotheses import Guess

logger = logging.getLogger(__name__)


@register("structure", "classify")
@dataclass(frozen=True, kw_only=True, eq=False)
class Classify(Structure):
    """Polycubes predicted by the trained classifier and placed by bounding boxes; no diffusion.

    Parameters
    ----------
    grid : cells of the polycube along x, y, z
    primitives : (3, 3, 3) bool voxels by name
    weights : a .ckpt, a .safetensors or a folder of train.py; null: the included weights
    kept : largest number of structures
    frames : number of coordinate frames that are tried
    seed : seed of the sample points
    """

    references: ClassVar[tuple[str, ...]] = ("yu2024dl",)

    needs_network = True

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    weights: str | None = setting("ckpt", None)
    kept: int = 6
    frames: int = 2
    seed: int = setting("seed", 0)

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, the most probable first; empty if the user chooses the context.

        Also empty if the weights were trained for another grid or other primitives.

        Raises InputError if the weights were trained without a classifier.
        """
        from .hypotheses import denoiser_of_grid, guesses

        denoiser = denoiser_of_grid(self.weights, self.grid, self.primitives)
        if denoiser is None:
            return []
        if not denoiser.options.classifier:
            raise InputError(
                "structure=classify needs weights with a classifier, options.classifier=true in "
                f"their YAML; {self.weights or 'the included ones'} have none"
            )
        if any(candidate.proposal == "given" for candidate in candidates):
            return []
        best: dict[str, Guess] = {}
        for guess in guesses(denoiser, surface, self.primitives, self.frames, self.seed):
            best.setdefault(guess.key, guess)
        found = [_stretched(guess, surface) for guess in list(best.values())[: self.kept]]
        logger.info(
            "classify: %d of %d structures proposed, probability %s",
            len(found),
            len(best),
            ", ".join(f"{candidate.probability:.3f}" for candidate in found) or "none",
        )
        return found


def _stretched(guess: Guess, surface: TriMesh) -> Candidate:
    """The polycube of a guess with its box on that of the part, in the rotation of the guess."""
    from polycube.structure.rough_map import affine_map

    from .hypotheses import UNLIKELY

    return Candidate(
        "classify",
        guess.polycube,
        affine_map(guess.polycube, *guess.box(surface)),
        -UNLIKELY * guess.log_likelihood,
        guess.key,
        probability=guess.probability,
    )
