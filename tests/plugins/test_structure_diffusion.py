"""The trained network proposes structures; with earlier proposals it denoises those."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.geometry.frames import rotations, turn
from polycube.geometry.lattice import boundary, collapse, genus, lattice
from polycube.geometry.projection import project
from polycube.geometry.rough_map import evaluate
from polycube.registry import build
from polycube.types import Candidate, TriMesh
from tests.polycubes import PRIMITIVES, THREE, TWO, part

TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix() @ np.diag([20.0, 15.0, 11.0])


def propose(
    surface: TriMesh, earlier: tuple[Candidate, ...] = (), grid=TWO, **options
) -> list[Candidate]:
    config = {"plugin": "diffusion", "sampler": {"plugin": "ddim", "steps": 2}, **options}
    return build("structure", config, grid=grid, primitives=PRIMITIVES)(surface, earlier)


@pytest.fixture(scope="module")
def eight() -> TriMesh:
    return part(("hole_y", "hole_y"), TURNED)


@pytest.fixture(scope="module")
def sliced(eight: TriMesh) -> tuple[Candidate, ...]:
    slices = build("structure", {"plugin": "slices"}, grid=TWO, primitives=PRIMITIVES)
    return tuple(slices(eight, ()))


def test_alone_it_finds_two_parallel_holes_in_a_turned_part(eight: TriMesh) -> None:
    found = propose(eight)
    true = collapse(lattice(TWO, ("hole_y", "hole_y"), PRIMITIVES)).occupancy
    turned = [turn(true, rotation) for rotation in rotations()]
    assert all(genus(candidate.polycube) == 2 for candidate in found)
    assert [c.cost for c in found] == sorted(c.cost for c in found)
    assert any(np.array_equal(found[0].polycube.occupancy, boxes) for boxes in turned)
    assert len({candidate.key for candidate in found}) == len(found)


def test_rough_map_places_the_polycube_on_the_part(eight: TriMesh) -> None:
    """Corners of the part come near corners of the placed polycube: within 0.35 cells."""
    best = propose(eight)[0]
    placed = evaluate(best.rough_map, boundary(best.polycube).vertices)
    true = boundary(collapse(lattice(TWO, ("hole_y", "hole_y"), PRIMITIVES))).vertices
    gap = np.linalg.norm(placed[:, None] - true @ TURNED.T, axis=2).min(axis=0)
    assert gap.mean() < 0.35 * np.cbrt(np.linalg.det(TURNED))


def test_trajectory_goes_from_the_part_to_near_the_polycube(eight: TriMesh) -> None:
    best = propose(eight)[0]
    assert best.trajectory.shape == (5, 1024, 3)
    away = [
        np.linalg.norm(project(best.polycube, state)[0] - state, axis=1).mean()
        for state in best.trajectory[[0, -1]].astype(float)
    ]
    assert away[1] < 0.12 and away[1] < away[0]


def test_earlier_candidates_keep_their_key_and_orientation(
    eight: TriMesh, sliced: tuple[Candidate, ...]
) -> None:
    found = propose(eight, sliced, samples=2)
    assert 1 <= len(found) <= 2
    for candidate in found:
        (source,) = [c for c in sliced if c.key == candidate.key][:1]
        assert candidate.proposal == "diffusion"
        assert candidate.polycube is source.polycube
        corners = boundary(source.polycube).vertices
        linear = [
            np.linalg.lstsq(corners - corners.mean(axis=0), evaluate(m, corners), rcond=None)[0]
            for m in (source.rough_map, candidate.rough_map)
        ]
        assert np.linalg.det(linear[0]) * np.linalg.det(linear[1]) > 0


def test_the_seed_decides(eight: TriMesh, sliced: tuple[Candidate, ...]) -> None:
    one, same, other = (propose(eight, sliced[:1], seed=seed)[0] for seed in (0, 0, 1))
    assert np.array_equal(one.trajectory, same.trajectory)
    assert not np.array_equal(one.trajectory, other.trajectory)


def test_grids_the_weights_do_not_know_are_left_to_others(
    eight: TriMesh, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level("INFO"):
        assert propose(eight, grid=THREE) == []
    assert "the weights know grid 2x1x1 with cube, hole_z, hole_x, hole_y only" in caplog.text


def test_a_genus_without_context_gives_nothing() -> None:
    three_holes = part(("hole_y", "hole_y", "hole_y"), np.eye(3), grid=THREE)
    assert propose(three_holes) == []
