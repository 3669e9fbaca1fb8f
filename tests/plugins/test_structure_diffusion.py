"""The trained network proposes structures; it also denoises those of earlier proposals."""

import logging

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.diffusion.weights import shipped
from polycube.registry import build
from polycube.structure.lattice import boundary, collapse, genus, lattice
from polycube.structure.projection import project
from polycube.structure.rough_map import evaluate
from polycube.surface.frames import rotations, turn
from polycube.types import Candidate, TriMesh
from tests.fixtures.polycubes import PRIMITIVES, THREE, TWO, part

TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix() @ np.diag([20.0, 15.0, 11.0])


def propose(
    surface: TriMesh, earlier: tuple[Candidate, ...] = (), grid=TWO, **options
) -> list[Candidate]:
    config = {"plugin": "diffusion", "sampler": {"plugin": "ddim", "steps": 1}, **options}
    return build("structure", config, grid=grid, primitives=PRIMITIVES)(surface, earlier)


@pytest.fixture(scope="module")
def eight() -> TriMesh:
    return part(("hole_y", "hole_y"), TURNED)


@pytest.fixture(scope="module")
def alone(eight: TriMesh) -> list[Candidate]:
    return propose(eight)


@pytest.fixture(scope="module")
def sliced(eight: TriMesh) -> tuple[Candidate, ...]:
    slices = build("structure", {"plugin": "slices"}, grid=TWO, primitives=PRIMITIVES)
    return tuple(slices(eight, ()))


def is_eight(candidate: Candidate) -> bool:
    true = collapse(lattice(TWO, ("hole_y", "hole_y"), PRIMITIVES)).occupancy
    turned = [turn(true, rotation) for rotation in rotations()]
    return any(np.array_equal(candidate.polycube.occupancy, boxes) for boxes in turned)


def test_alone_it_finds_two_parallel_holes_in_a_turned_part(alone: list[Candidate]) -> None:
    assert all(genus(candidate.polycube) == 2 for candidate in alone)
    assert [c.cost for c in alone] == sorted(c.cost for c in alone)
    assert is_eight(alone[0]) and alone[0].probability > 0.5
    assert len({candidate.key for candidate in alone}) == len(alone)


def test_rough_map_places_the_polycube_on_the_part(alone: list[Candidate]) -> None:
    """Corners of the part come near corners of the placed polycube: within 0.2 cells."""
    placed = evaluate(alone[0].rough_map, boundary(alone[0].polycube).vertices)
    true = boundary(collapse(lattice(TWO, ("hole_y", "hole_y"), PRIMITIVES))).vertices
    gap = np.linalg.norm(placed[:, None] - true @ TURNED.T, axis=2).min(axis=0)
    assert gap.mean() < 0.2 * np.cbrt(np.linalg.det(TURNED))


def test_thin_and_long_parts_are_placed_as_well_as_others() -> None:
    """The fit is made in cells: 10 : 2 : 1 is no harder than a part like the polycube."""
    gaps = []
    for sides in (np.ones(3), np.array([10.0, 2.0, 1.0])):
        best = propose(part(("hole_y", "hole_y"), np.diag(sides)), tried=4)[0]
        placed = evaluate(best.rough_map, boundary(best.polycube).vertices) / sides
        true = boundary(collapse(lattice(TWO, ("hole_y", "hole_y"), PRIMITIVES))).vertices
        gaps.append(np.linalg.norm(placed[:, None] - true, axis=2).min(axis=0).mean())
    assert gaps[1] < max(0.2, 1.5 * gaps[0])


def test_trajectory_goes_from_the_part_to_near_the_polycube(alone: list[Candidate]) -> None:
    best = alone[0]
    assert best.trajectory.shape == (len(best.steps), 1024, 3)
    away = [
        np.linalg.norm(project(best.polycube, state)[0] - state, axis=1).mean()
        for state in best.trajectory[[0, -1]].astype(float)
    ]
    assert away[1] < 0.12 and away[1] < away[0]


def test_earlier_candidates_get_a_trajectory_and_a_probability(
    eight: TriMesh, sliced: tuple[Candidate, ...]
) -> None:
    found = propose(eight, sliced, tried=4)
    earlier = {id(candidate.rough_map): candidate for candidate in sliced}
    updated = [candidate for candidate in found if id(candidate.rough_map) in earlier]
    assert {c.key for c in updated} >= {c.key for c in sliced[:4]}
    for candidate in updated:
        old = earlier[id(candidate.rough_map)]
        assert candidate.trajectory is not None and 0 <= candidate.probability <= 1
        assert candidate.proposal == "slices"
        assert (candidate.cost, candidate.polycube) == (old.cost, old.polycube)
    new = [candidate for candidate in found if candidate not in updated]
    assert is_eight(new[0]) and {c.proposal for c in new} == {"diffusion"}


def test_a_structure_missing_among_earlier_candidates_is_proposed(
    eight: TriMesh, sliced: tuple[Candidate, ...]
) -> None:
    wrong = tuple(candidate for candidate in sliced if not is_eight(candidate))
    assert wrong
    new = [c for c in propose(eight, wrong, tried=4) if c.proposal == "diffusion"]
    assert is_eight(new[0])


def test_a_given_context_is_not_replaced(eight: TriMesh) -> None:
    config = {"plugin": "given", "context": ["hole_y", "hole_z"]}
    given = build("structure", config, grid=TWO, primitives=PRIMITIVES)(eight, ())
    found = propose(eight, tuple(given))
    assert found and {c.key for c in found} <= {c.key for c in given}


def test_the_seed_decides(eight: TriMesh, sliced: tuple[Candidate, ...]) -> None:
    one, same, other = (propose(eight, sliced[:1], seed=s, tried=0)[0] for s in (0, 0, 1))
    assert np.array_equal(one.trajectory, same.trajectory)
    assert not np.array_equal(one.trajectory, other.trajectory)


def test_nothing_is_proposed_for_grids_without_weights(
    eight: TriMesh, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        assert propose(eight, grid=(7, 1, 1)) == []
        assert propose(eight, grid=THREE, weights=str(shipped())) == []
    assert "no weights are included for grid 7x1x1; nothing is proposed" in caplog.text
    assert "the weights are for grid 2x1x1 with cube, hole_z, hole_x, hole_y only" in caplog.text


def test_a_genus_without_context_gives_nothing() -> None:
    three_holes = part(("hole_y", "hole_y", "hole_y"), np.eye(3), grid=THREE)
    assert propose(three_holes) == []
