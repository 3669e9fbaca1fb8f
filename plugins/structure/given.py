"""Propose the context that a person gives, in all frames and orientations."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polycube.errors import InputError
from polycube.kinds import Structure
from polycube.registry import register
from polycube.structure.lattice import collapse, genus, is_manifold, lattice
from polycube.surface import measures as surfaces
from polycube.surface.frames import rotations, turn
from polycube.types import Candidate, Polycube, TriMesh

from .boxes import boxed
from .slices.candidates import Reader, as_candidate, distinct_turns
from .slices.patterns import Word, spell

logger = logging.getLogger(__name__)


@register("structure", "given")
@dataclass(frozen=True, kw_only=True, eq=False)
class Given(Reader, Structure):
    """Place one context on the part: by its slices if it is a row of known slabs, else by boxes."""

    context: Sequence[str | None]  # per grid cell, x slowest; the last ones may be left out

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first; raises InputError when the context cannot fit the surface."""
        full = self._polycube()
        polycube, named = collapse(full), ", ".join(map(str, self.context))
        if not is_manifold(polycube):
            raise InputError(f"context {named} is no solid in one piece without voids")
        wanted, has = surfaces.genus(surface), genus(polycube)
        if has != wanted:
            raise InputError(f"context {named} has genus {has}, but the surface has genus {wanted}")
        found: list[Candidate] = []
        for frame, view in enumerate(self.views(surface)):
            readings = [
                reading
                for solid, letters in self._words(full).items()
                for reading in self.readings(
                    view, distinct_turns(solid, of_row=True), [Word(letters, (collapse(solid),))]
                )
            ]
            found += [as_candidate(reading, "given", frame) for reading in readings]
            if not readings:
                found += boxed(polycube, view, distinct_turns(polycube), frame, "given")
        logger.info("given: %d placements of %s", len(found), named)
        return sorted(found, key=lambda candidate: candidate.cost)

    def _words(self, full: Polycube) -> dict[Polycube, str]:
        """The polycube and its word, if it has one; for one cell also those of the cell turned."""
        if full.grid[1:] != (1, 1):
            return {}
        cells = [index for index, name in enumerate(full.context) if name is not None]
        solids = [full]
        if len(cells) == 1:
            own = self.primitives[full.context[cells[0]]]
            turned = {turn(own, rotation).tobytes() for rotation in rotations()}
            names = [name for name, cell in self.primitives.items() if cell.tobytes() in turned]
            rest = (None,) * (len(full.context) - 1)
            solids = [lattice(self.grid, (name, *rest), self.primitives) for name in names]
        words = {solid: spell(solid.context, self.primitives) for solid in solids}
        return {solid: letters for solid, letters in words.items() if letters}

    def _polycube(self) -> Polycube:
        n_cells = int(np.prod(self.grid))
        shape = "x".join(map(str, self.grid))
        if not 0 < len(self.context) <= n_cells:
            raise InputError(
                f"context must name 1 to {n_cells} cells of the {shape} grid; got {self.context}"
            )
        context = tuple(self.context) + (None,) * (n_cells - len(self.context))
        if not any(context):
            raise InputError(f"context must fill at least one cell; got {self.context}")
        try:
            return lattice(self.grid, context, self.primitives)
        except LookupError as error:
            raise InputError(f"context: {error.args[0]}") from None
