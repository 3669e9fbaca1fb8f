"""The kernels compared with a simple numpy version and finite differences."""

import numpy as np
import pytest

from polycube.fitting import energy
from polycube.fitting.energy import Terms
from polycube.fitting.springs import pull, together
from polycube.hexmesh.connectivity import CORNERS
from tests.fixtures.fitting import springs
from tests.fixtures.hexmeshes import unit_cubes

TERMS = Terms(shape=0.7, eps=0.05, barrel=0.3, jacobian=0.4, beta=3.0, offset=0.2)


@pytest.fixture
def distorted() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A box with some hexes inverted, and wanted lengths."""
    rng = np.random.default_rng(0)
    vertices, cubes = unit_cubes(3, 2, 2)
    return (
        vertices + 0.3 * rng.normal(size=vertices.shape),
        cubes,
        rng.uniform(0.5, 2, (len(cubes), 3)),
    )


def frames(x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray):
    """Edges (H, 9, 3, 3) of all frames and the wanted length of each."""
    p = x[hexes]
    corner = p[:, CORNERS[:, 1:]] - p[:, CORNERS[:, :1]]
    centre = np.stack(
        [
            p[:, [1, 2, 5, 6]].mean(1) - p[:, [0, 3, 4, 7]].mean(1),
            p[:, [2, 3, 6, 7]].mean(1) - p[:, [0, 1, 4, 5]].mean(1),
            p[:, 4:].mean(1) - p[:, :4].mean(1),
        ],
        axis=1,
    )
    cube = unit_cubes(1, 1, 1)
    places = cube[0][cube[1][0]]
    direction = np.abs(places[CORNERS[:, 1:]] - places[CORNERS[:, :1]]).argmax(axis=2)
    direction = np.vstack([direction, [0, 1, 2]])
    return np.concatenate([corner, centre[:, None]], axis=1), lengths[:, direction]


def reference(x, hexes, lengths, terms, pulls) -> float:
    """The formulas of the docstring of the module, without optimisation."""
    edges, wanted = frames(x, hexes, lengths)
    scaled = edges / wanted[..., None]
    d, norm = np.linalg.det(scaled), (scaled**2).sum(axis=(2, 3))
    chi = (d + np.sqrt(terms.eps**2 + d**2)) / 2
    shape = norm / (3 * chi ** (2 / 3)) + terms.barrel * (d**2 + 1) / (2 * chi)
    s = np.linalg.det(edges) / np.linalg.norm(edges, axis=3).prod(axis=2)
    jacobian = np.exp(-terms.beta * (s - terms.offset)) / terms.beta
    total = (terms.shape * shape + terms.jacobian * jacobian).sum() / 8
    r = np.einsum("sk,skd->sd", pulls.share, x[pulls.vertex]) - pulls.goal
    across = np.einsum("sd,sd->s", r, pulls.direction)
    return total + (pulls.along * across**2 + pulls.every * (r**2).sum(axis=1)).sum()


def test_value_equals_the_reference(distorted):
    x, hexes, lengths = distorted
    pulls = springs(len(x))
    value, _ = energy.energy(x, hexes, lengths, TERMS, pulls)
    assert value == pytest.approx(reference(x, hexes, lengths, TERMS, pulls), rel=1e-12)


@pytest.mark.parametrize("terms", [TERMS, Terms(), Terms(shape=0.0, jacobian=1.0, beta=8.0)])
def test_gradient_equals_finite_differences(distorted, terms):
    x, hexes, lengths = distorted
    terms = terms._replace(eps=0.05)
    pulls = springs(len(x))
    _, gradient = energy.energy(x, hexes, lengths, terms, pulls)
    for seed in range(5):
        step = 1e-6 * np.random.default_rng(seed).normal(size=x.shape)
        ends = [energy.energy(x + s * step, hexes, lengths, terms, pulls)[0] for s in (1, -1)]
        assert (ends[0] - ends[1]) / 2 == pytest.approx((gradient * step).sum(), rel=1e-5)


def test_an_ideal_hex_has_the_least_shape_energy():
    x, cube = unit_cubes(1, 1, 1)
    lengths, none = np.ones((1, 3)), springs(8)
    none = none._replace(along=np.zeros(7), every=np.zeros(7))
    value, gradient = energy.energy(x, cube, lengths, Terms(eps=1e-9, barrel=0.1), none)
    assert value == pytest.approx(9 / 8 * (1 + 0.1))
    assert gradient == pytest.approx(0, abs=1e-9)


def test_least_determinant_includes_corners_and_centre(distorted):
    x, hexes, lengths = distorted
    edges, wanted = frames(x, hexes, lengths)
    found = np.linalg.det(edges / wanted[..., None]).min()
    assert energy.least_determinant(x, hexes, lengths) == pytest.approx(found)


def test_energy_below_the_floor_is_infinite(distorted):
    x, hexes, lengths = distorted
    least = energy.least_determinant(x, hexes, lengths)
    for floor, finite in ((least - 1e-9, True), (least + 1e-9, False)):
        terms = TERMS._replace(floor=floor)
        assert np.isfinite(energy.energy(x, hexes, lengths, terms, springs(len(x)))[0]) == finite


def test_pull_is_a_spring_on_one_vertex():
    x, cube = unit_cubes(1, 1, 1)
    goal = x[3:4] + np.array([1, 2, 0])
    single = pull(np.array([3]), goal, np.eye(3)[:1], np.ones(1), np.ones(1))
    both = together([single, single])
    terms = Terms(shape=0.0)
    value, gradient = energy.energy(x, cube, np.ones((1, 3)), terms, both)
    assert value == pytest.approx(2 * (1 + 5))
    assert gradient[3] == pytest.approx([-8, -8, 0])
    assert not np.delete(gradient, 3, axis=0).any()
