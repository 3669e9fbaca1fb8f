"""The state from which a structure is meshed."""

import numpy as np

from polycube.search.history import choose
from polycube.state import RunState
from polycube.structure.lattice import collapse, lattice
from polycube.structure.rough_map import affine_map
from polycube.types import Candidate, Ranked
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.polycubes import PRIMITIVES, TWO, part


def test_the_state_has_the_denoising_of_the_structure_that_is_chosen():
    polycube = collapse(lattice(TWO, ("cube", "hole_y"), PRIMITIVES))
    surface = part(("cube", "hole_y"), np.eye(3))
    rough_map = affine_map(polycube, np.eye(3), np.zeros(3))
    states = np.random.default_rng(0).uniform(size=(3, 20, 3))
    plain = Candidate("slices", polycube, rough_map, 0.0, "one")
    other = Candidate("slices", polycube, rough_map, 0.0, "other")
    denoised = Candidate("diffusion", polycube, rough_map, 0.0, "one", states, steps=(9, 4, 0))
    hexes = hex_box()
    ranked = [Ranked(c, 1.0, {}, hexes, hexes.vertices) for c in (plain, other, denoised)]
    first = choose(RunState(surface, ranked=ranked), 0, PRIMITIVES)
    assert first.trajectory is states and first.steps == (9, 4, 0)
    assert first.polycube is polycube and len(first.parametrization.positions) == len(
        surface.vertices
    )
    second = choose(first, 1, PRIMITIVES)
    assert second.chosen == 1 and second.trajectory is None and second.steps == ()
