"""Structures by the classifier alone, compared with a separate evaluation of every context."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.templates import contexts
from polycube.diffusion.weights import load_denoiser, make_denoiser, save_denoiser
from polycube.errors import InputError
from polycube.plugins.structure.learned.hypotheses import sample
from polycube.plugins.structure.slices.candidates import structure_key
from polycube.registry import build
from polycube.structure.lattice import collapse, genus, lattice
from polycube.structure.rough_map import evaluate
from polycube.surface.frames import frames, rotations, turn
from polycube.types import Candidate, TriMesh
from tests.fixtures.polycubes import PRIMITIVES, TWO, part

SIDES = np.diag([20.0, 15.0, 11.0])
TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix() @ SIDES


def classify(surface: TriMesh, earlier: tuple[Candidate, ...] = (), **options) -> list[Candidate]:
    config = {"plugin": "classify", **options}
    return build("structure", config, grid=TWO, primitives=PRIMITIVES)(surface, earlier)


@pytest.mark.parametrize("context", [("hole_y", "hole_y"), ("hole_x", "hole_y"), ("cube", None)])
def test_rotated_polycubes_are_recognised(context: tuple[str | None, ...]) -> None:
    best = classify(part(context, TURNED))[0]
    true = collapse(lattice(TWO, context, PRIMITIVES)).occupancy
    assert any(np.array_equal(turn(true, r), best.polycube.occupancy) for r in rotations())
    assert best.probability > 0.5 and best.trajectory is None


def test_the_box_of_the_polycube_is_that_of_the_part_in_its_frame() -> None:
    surface = part(("hole_y", "hole_y"), TURNED)
    for candidate in classify(surface):
        ends = [knots[[0, -1]] for knots in candidate.polycube.knots]
        corners = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
        placed = evaluate(candidate.rough_map, corners)
        sides = np.linalg.norm(np.diff(placed[[[0, 4], [0, 2], [0, 1]]], axis=1), axis=(1, 2))
        assert sorted(sides) == pytest.approx([11, 15, 40], rel=0.05)
        assert np.linalg.det(placed[[4, 2, 1]] - placed[0]) > 0


def test_probabilities_and_order_are_those_of_single_contexts() -> None:
    surface = part(("hole_x", "hole_y"), TURNED)
    denoiser = load_denoiser(build)
    named = [c for c in contexts(TWO, PRIMITIVES) if c[0] is not None]  # the others are the same
    polycubes = [collapse(lattice(TWO, context, PRIMITIVES)) for context in named]
    frame = frames(surface, 1)[0]
    points, normals = sample(surface, 1024, np.random.default_rng(0))
    log_ps: dict[str, list[float]] = {}
    for view in rotations():
        normalised = learning_frame(surface.vertices, view @ frame).apply(points)
        log_p = denoiser.log_likelihood(
            normalised[None], (normals @ (view @ frame).T)[None], named
        )[0]
        largest: dict[str, float] = {}
        for polycube, value in zip(polycubes, log_p, strict=True):
            if genus(polycube) == 1:
                key = structure_key(polycube, view, 0)
                largest[key] = max(value, largest.get(key, value))
        for key, value in largest.items():
            log_ps.setdefault(key, []).append(value)
    mean = {key: np.exp(np.mean(values)) for key, values in log_ps.items()}
    found = classify(surface, frames=1, kept=100)
    assert [c.key for c in found] == sorted(mean, key=lambda key: -mean[key])
    for candidate in found[:5]:
        expected = mean[candidate.key] / sum(mean.values())
        assert candidate.probability == pytest.approx(expected, rel=1e-3)


def test_a_given_context_is_not_replaced() -> None:
    surface = part(("hole_y", "hole_y"), SIDES)
    config = {"plugin": "given", "context": ["hole_y", "hole_z"]}
    given = build("structure", config, grid=TWO, primitives=PRIMITIVES)(surface, ())
    assert classify(surface, tuple(given)) == []


def test_weights_without_a_classifier_are_refused(tmp_path: Path) -> None:
    config = {
        "grid": [2, 1, 1],
        "primitives": list(PRIMITIVES),
        "schedule": {"plugin": "linear", "steps": 50},
        "model": {"plugin": "tiny"},
        "options": {"classifier": False},
    }
    save_denoiser(make_denoiser(config, build), config, {}, tmp_path)
    with pytest.raises(InputError, match="needs weights with a classifier"):
        classify(part(("cube", None), SIDES), weights=str(tmp_path))
