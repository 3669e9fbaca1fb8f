"""Propose the context chosen by the user, in all frames and rotations."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycube.errors import InputError
from polycube.kinds import Structure
from polycube.registry import register
from polycube.types import Candidate, Polycube, RoughMap, TriMesh

from .slices.options import SliceOptions

if TYPE_CHECKING:
    from .slices.alignment import View

logger = logging.getLogger(__name__)

STARTS = 9  # starts of the search for knots


@register("structure", "given")
@dataclass(frozen=True, kw_only=True, eq=False)
class Given(SliceOptions, Structure):
    """Place the context that the user chooses, in every orientation.

    A row of slabs is placed by slices of the part, any other polycube by boxes.

    Parameters
    ----------
    context : primitive of each grid cell, such as [cube, hole_z]; x varies slowest; null: empty
        cell; missing cells at the end are empty
    """

    context: Sequence[str | None]

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """Candidates, cheapest first; raises InputError if the context cannot fit the surface."""
        from polycube.structure.lattice import collapse, genus, is_manifold
        from polycube.surface import measures as surfaces

        from .slices.alignment import SlabPattern
        from .slices.candidates import alignments, as_candidate, distinct_turns, views

        full = self._polycube()
        polycube, named = collapse(full), ", ".join(map(str, self.context))
        if not is_manifold(polycube):
            raise InputError(f"context {named} is not one solid without voids")
        wanted, has = surfaces.genus(surface), genus(polycube)
        if has != wanted:
            raise InputError(f"context {named} has genus {has}, but the surface has genus {wanted}")
        found: list[Candidate] = []
        for frame, view in enumerate(views(self, surface)):
            aligned = []
            for solid, slabs in self._slabs(full).items():
                pattern = SlabPattern(slabs, (collapse(solid),))
                aligned += alignments(self, view, distinct_turns(solid, of_row=True), [pattern])
            found += [as_candidate(each, "given", frame) for each in aligned]
            if not aligned:
                found += boxed(polycube, view, distinct_turns(polycube), frame)
        logger.info("given: %d placements of %s", len(found), named)
        return sorted(found, key=lambda candidate: candidate.cost)

    def _slabs(self, full: Polycube) -> dict[Polycube, str]:
        """The polycube and its slabs, if they have a pattern; for one cell also its rotations."""
        from polycube.structure.lattice import lattice
        from polycube.surface.frames import rotations, turn

        from .slices.alignment import slabs_of_context

        if full.grid[1:] != (1, 1):
            return {}
        filled = [name for name in full.context if name is not None]
        solids = [full]
        if len(filled) == 1:
            own = self.primitives[filled[0]]
            turned = {turn(own, rotation).tobytes() for rotation in rotations()}
            names = [name for name, cell in self.primitives.items() if cell.tobytes() in turned]
            rest = (None,) * (len(full.context) - 1)
            solids = [lattice(self.grid, (name, *rest), self.primitives) for name in names]
        slabs_of = {solid: slabs_of_context(solid.context, self.primitives) for solid in solids}
        return {solid: slabs for solid, slabs in slabs_of.items() if slabs}

    def _polycube(self) -> Polycube:
        from polycube.structure.lattice import lattice

        n_cells = int(np.prod(self.grid))
        shape = "x".join(map(str, self.grid))
        if not 0 < len(self.context) <= n_cells:
            what = f"context must name 1 to {n_cells} cells of the {shape} grid; got {self.context}"
            raise InputError(what)
        context = tuple(self.context) + (None,) * (n_cells - len(self.context))
        if not any(context):
            raise InputError(f"context must fill at least one cell; got {self.context}")
        try:
            return lattice(self.grid, context, self.primitives)
        except LookupError as error:
            raise InputError(f"context: {error.args[0]}") from None


def boxed(
    polycube: Polycube, view: View, turns: Iterable[np.ndarray], frame: int
) -> list[Candidate]:
    """The polycube on the part in each rotation (3, 3) from the view to its axes.

    The bounding box of the polycube is placed on that of the part, and its inner knots where they
    fit best. The cost is the volume filled by only one of the two, as a share of the volume of the
    part. Rotations in which the part has fewer voxels than the polycube has slabs are omitted.
    """
    from polycube.surface.frames import turn

    from .slices.candidates import structure_key
    from .slices.knots import cumulative, fit_knots

    solid = view.voxels.solid[1:-1, 1:-1, 1:-1]
    counts = cumulative(solid)
    found = []
    for rotation in turns:
        slabs = turn(polycube.occupancy, rotation.T)
        if (np.array(slabs.shape) > solid.shape).any():
            continue
        knots, misfit = fit_knots(slabs, counts, STARTS)
        corners = np.meshgrid(*[k + 1 for k in knots], indexing="ij")
        at = np.stack([turn(corner, rotation) for corner in corners], axis=-1)
        rough_map = RoughMap(*polycube.knots, view.to_model(at))
        key = structure_key(polycube, rotation, frame)
        found.append(Candidate("given", polycube, rough_map, float(misfit / solid.sum()), key))
    return found
