"""Any grid, through contexts, pairs, network and sampler, to a placed polycube."""

import numpy as np
import pytest

from polycube.diffusion.weights import make_denoiser
from polycube.registry import build
from polycube.structure.lattice import collapse, lattice
from polycube.structure.projection import project

USE = ("cube", "blind_px", "cross_xy")


FLAT = [(1, 1, 1), (3, 1, 1), (4, 1, 1), (2, 2, 1)]
LONG = [pytest.param(grid, marks=pytest.mark.slow) for grid in [(3, 2, 1), (2, 2, 2)]]


@pytest.mark.parametrize("grid", [*FLAT, (2, 1, 2), *LONG])
def test_a_grid_goes_all_the_way(grid: tuple, config: dict) -> None:
    primitives = {name: build("primitive", {"plugin": name})() for name in USE}
    denoiser = make_denoiser({**config, "grid": list(grid), "primitives": list(USE)}, build)
    pairs = build("data", {"plugin": "paired"})(grid, primitives, seed=0)
    made = [pairs(index) for index in range(4)]
    points, normals = (np.stack([getattr(p, n) for p in made]) for n in ("geometry", "normals"))
    assert points.shape == (4, 512 * np.prod(grid), 3)
    origin = np.array(grid) / 2
    for pair in made:
        polycube = collapse(lattice(grid, pair.context, primitives))
        nearest, _ = project(polycube, pair.polycube + origin)
        assert np.abs(nearest - pair.polycube - origin).max() < 1e-6
    sampler = build("sampler", {"plugin": "ddim", "steps": 1})
    found = denoiser.denoise(points, normals, [pair.context for pair in made], sampler, 0)
    assert found.points.shape == points.shape and np.isfinite(found.points).all()
