"""Algorithm 2 in the context of the user: placements, the assignment of points, and refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.config import compose
from polycube.diffusion.denoiser import DenoiserOptions
from polycube.diffusion.weights import SHIPPED, load_denoiser, make_denoiser, save_denoiser
from polycube.errors import InputError
from polycube.plugins.structure.learned import denoising
from polycube.registry import build
from polycube.structure.lattice import lattice
from tests.fixtures.polycubes import PRIMITIVES, TWO, part

TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix() @ np.diag([20.0, 15.0, 11.0])
NAMES = ["cube", "hole_z", "hole_x", "hole_y"]


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """An untrained network with the inputs of the published one."""
    options = compose("train", ["experiment=paper"])["denoiser"] | {"pads": True}
    assert DenoiserOptions(**options).target == "noise"
    recipe = {
        "grid": list(TWO),
        "primitives": NAMES,
        "schedule": {"plugin": "linear", "steps": 5},
        "model": {"plugin": "tiny"},
        "options": options,
    }
    folder = tmp_path_factory.mktemp("weights")
    save_denoiser(make_denoiser(recipe, build), recipe, {}, folder)
    return str(folder)


def propose(context: list, **options: object) -> list:
    config = {"plugin": "paper", "context": context, **options}
    plugin = build("structure", config, grid=TWO, primitives={n: PRIMITIVES[n] for n in NAMES})
    return plugin(part(("hole_y", "cube"), TURNED), ())


@pytest.mark.slow
def test_the_context_is_placed_and_denoised(weights: str) -> None:
    found = propose(["cube", "hole_z"], weights=weights, tried=2)
    assert 1 <= len(found) <= 2 and [c.cost for c in found] == sorted(c.cost for c in found)
    for candidate in found:
        assert candidate.proposal == "paper"
        assert sorted(candidate.polycube.context) == ["cube", "hole_z"]
        assert candidate.trajectory.shape == (len(candidate.steps), 1024, 3)


def test_points_are_assigned_to_the_nearest_as_a_whole() -> None:
    """A shuffled copy in a scaled box is matched exactly."""
    rng = np.random.default_rng(0)
    x_0, order = rng.random((60, 3)), rng.permutation(60)
    linear, offset = np.diag([3.0, 0.5, 2.0]), np.array([1.0, -2, 4])
    points = (x_0 @ linear.T + offset)[order]
    assert np.array_equal(order[denoising._assigned(points, x_0, linear, offset)], np.arange(60))


def test_it_needs_a_context_of_the_right_genus(weights: str) -> None:
    with pytest.raises(InputError, match="structure=paper needs a context"):
        propose([], weights=weights)
    with pytest.raises(InputError, match="has genus 0, but the surface has genus 1"):
        propose(["cube", "cube"], weights=weights)


@pytest.mark.slow
def test_the_included_weights_retrieve_the_templates_of_their_types() -> None:
    """Without new noise, x_0 is near the polycube for all nine types."""
    denoiser = load_denoiser(build, SHIPPED / "paper")
    pairs = build("data", {"plugin": "paper"})(TWO, {n: PRIMITIVES[n] for n in NAMES}, 0)
    sampler = build("sampler", {"plugin": "ddim", "steps": 50})
    for pair in map(pairs, range(9)):
        rows = [x[None] for x in (pair.geometry, pair.normals)]
        found = denoiser.denoise(*rows, [pair.context], sampler, 0).points[0]
        found = found - denoiser.condition.origin
        assert np.linalg.norm(found - pair.polycube, axis=1).mean() < 0.15


def test_a_noisy_result_is_put_into_the_box_of_its_polycube() -> None:
    """A displaced and shrunk result with a few outliers is where it belongs."""
    rng = np.random.default_rng(0)
    (pair,) = [build("data", {"plugin": "paper"})(TWO, {n: PRIMITIVES[n] for n in NAMES}, 0)(8)]
    polycube = lattice(TWO, pair.context, {n: PRIMITIVES[n] for n in NAMES})
    true = pair.polycube + np.array(TWO) / 2
    moved = true * 0.8 + [0.4, -0.2, 0.1]
    moved[rng.choice(len(moved), 5, replace=False)] += 3
    assert np.abs(denoising._boxed(moved, polycube) - true).mean() < 0.03
