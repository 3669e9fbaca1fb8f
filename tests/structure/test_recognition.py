"""Recognition of the structure from the positions of points."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from polycube.structure.lattice import collapse, genus, is_manifold, lattice
from polycube.structure.recognition import NOISE, OUTLIERS, log_likelihood, read_structure
from polycube.types import Polycube
from tests.conftest import first_quick
from tests.fixtures.polycubes import ONE, PRIMITIVES, TWO, on_boundary

FILLINGS = (*PRIMITIVES, None)
CONTEXTS = [
    (a, b) for a in FILLINGS for b in FILLINGS if is_manifold(lattice(TWO, (a, b), PRIMITIVES))
]


def equal(a: Polycube, b: Polycube) -> bool:
    a, b = collapse(a), collapse(b)
    return all(
        np.array_equal(x, y)
        for x, y in zip((a.occupancy, *a.knots), (b.occupancy, *b.knots), strict=True)
    )


@pytest.mark.parametrize(
    ("sigma", "every"), first_quick(1, [(0.05, 4), (0.0, 6), (0.1, 3), (0.1, 1)])
)
def test_structure_is_recognised_from_any_expected_structure(sigma: float, every: int) -> None:
    """Contexts of 2x1, each expected correctly and as another context of the same genus."""
    rng = np.random.default_rng(3)
    assert len(CONTEXTS) == 24
    for context in CONTEXTS[::every]:
        true = lattice(TWO, context, PRIMITIVES)
        points = on_boundary(true, 1024, rng) + rng.normal(0, sigma, (1024, 3))
        like = [lattice(TWO, c, PRIMITIVES) for c in CONTEXTS]
        like = [p for p in like if genus(p) == genus(true)]
        for supposed in (true, like[rng.integers(len(like))]):
            assert equal(read_structure(points, supposed, PRIMITIVES), true), context


@pytest.mark.parametrize("sigma", [0.15, 0.3])
def test_result_is_manifold_with_the_expected_genus_for_any_noise(sigma: float) -> None:
    rng = np.random.default_rng(0)
    for context in CONTEXTS[::5]:
        true = lattice(TWO, context, PRIMITIVES)
        points = on_boundary(true, 512, rng) + rng.normal(0, sigma, (512, 3))
        read = read_structure(points, true, PRIMITIVES)
        assert genus(read) == genus(true) and is_manifold(read)


def test_a_margin_favours_the_expected_structure() -> None:
    rng = np.random.default_rng(0)
    true, other = (lattice(TWO, ("cube", h), PRIMITIVES) for h in ("hole_z", "hole_y"))
    points = on_boundary(true, 1024, rng) + rng.normal(0, 0.1, (1024, 3))
    assert equal(read_structure(points, other, PRIMITIVES), true)
    assert read_structure(points, other, PRIMITIVES, margin=10.0) is other


def test_likelihood_is_the_integral_over_the_boundary() -> None:
    """Of one point and the unit cube, face by face, by quadrature."""
    cube = collapse(lattice(ONE, ("cube",), PRIMITIVES))
    point = np.array([0.8, 0.9, 1.05])

    def density(sigma: float) -> float:
        def over_face(axis: int, side: int) -> float:
            def gauss(v: float, u: float) -> float:
                at = np.insert([u, v], axis, side)
                return np.exp(-((point - at) ** 2).sum() / (2 * sigma**2))

            return dblquad(gauss, 0, 1, 0, 1)[0] / (2 * np.pi * sigma**2) ** 1.5

        return sum(over_face(axis, side) for axis in range(3) for side in (0, 1)) / 6

    expected = max(np.log(density(sigma) + OUTLIERS) for sigma in NOISE[1:])
    assert log_likelihood(point[None], cube) == pytest.approx(expected, abs=1e-6)
