"""A part in its frames, and candidates from bricks with the positions of its surface."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polycube.structure.lattice import of_bricks
from polycube.types import Candidate, TriMesh

from ..slices.candidates import structure_key
from .inverse import fitted


class View(NamedTuple):
    """A part in one of its frames."""

    number: int  # number of the frame
    surface: TriMesh  # in the frame, of diagonal 1
    place: np.ndarray  # (3, 3) from the frame to the part: row vectors times this
    genus: int


def views(surface: TriMesh, limit: int) -> Iterator[View]:
    """The part in its frames, the best first."""
    from polycube.surface.frames import frames
    from polycube.surface.measures import diagonal, genus

    size, handles = diagonal(surface), genus(surface)
    for number, frame in enumerate(frames(surface, limit)):
        turned = TriMesh(surface.vertices @ frame.T / size, surface.faces, surface.region)
        yield View(number, turned, frame * size, handles)


class OnBricks(NamedTuple):
    """A surface on a lattice of bricks."""

    full: np.ndarray  # (X, Y, Z) bool
    knots: list[np.ndarray]  # their positions along the axes, in the frame
    surface: TriMesh  # in the frame
    placed: np.ndarray  # (V, 3) positions of its vertices in knot numbers

    def candidate(
        self, proposal: str, view: View, smoothness: float, cost: float, brick: str
    ) -> Candidate:
        """The candidate of the bricks, each a primitive with the given name."""
        polycube = of_bricks(self.full, brick)
        rough_map = fitted(
            self.knots,
            TriMesh(self.placed, self.surface.faces),
            self.surface.vertices @ view.place,
            smoothness,
        )
        key = structure_key(polycube, np.eye(3), view.number)
        return Candidate(proposal, polycube, rough_map, cost, key)
