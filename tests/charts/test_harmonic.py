import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.charts.harmonic import cotangent, extend, flipped, mean_value


def square(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (n^2, 2) of a grid, its triangles, and whether each vertex is on the rim."""
    axis = np.linspace(0, 1, n)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = np.divmod(np.arange((n - 1) ** 2), n - 1)
    a, b, c, d = (i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return points, faces, ((points == 0) | (points == 1)).any(axis=1)


@pytest.mark.parametrize("weights", [cotangent, mean_value])
def test_linear_functions_on_a_plane_are_harmonic(weights):
    points, faces, rim = square(9)
    rng = np.random.default_rng(0)
    points[~rim] += 0.03 * rng.standard_normal(points[~rim].shape)
    turned = points @ np.linalg.qr(rng.standard_normal((3, 2)))[0].T
    start = np.where(rim[:, None], points, 0)
    found = extend(weights(turned[faces], faces, len(points)), start, rim)
    np.testing.assert_allclose(found, points, atol=1e-12)
    assert not flipped(found, faces).any()


def test_weights_of_a_right_angle():
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    faces = np.array([[0, 1, 2]])
    half = 0.5  # cot 45 / 2 on both legs, cot 90 = 0 on the long side
    wanted = [[0, half, half], [half, 0, 0], [half, 0, 0]]
    np.testing.assert_allclose(cotangent(corners, faces, 3).toarray(), wanted, atol=1e-12)
    at_apex = mean_value(corners, faces, 3).toarray()[0]
    np.testing.assert_allclose(at_apex, [0, 1, 1])  # tan(90 / 2) over leg 1


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 3))
def test_mean_value_weights_never_fold_onto_a_square(seed, height):
    points, faces, rim = square(7)
    rng = np.random.default_rng(seed)
    space = np.column_stack([points, height * rng.standard_normal(len(points))])
    weights = mean_value(space[faces], faces, len(points))
    assert weights.data.min() > 0
    assert not flipped(extend(weights, np.where(rim[:, None], points, 0), rim), faces).any()


def test_flipped_faces_are_found_and_flat_ones_ignored():
    points, faces, _ = square(4)
    assert not flipped(points, faces).any()
    assert flipped(points, faces[:, ::-1]).all()
    points[5] = points[10] + 0.1  # past its neighbours
    assert 0 < flipped(points, faces).sum() < len(faces)


def test_without_free_vertices_nothing_moves():
    points, faces, rim = square(3)
    weights = cotangent(np.column_stack([points, points[:, :1]])[faces], faces, 9)
    np.testing.assert_array_equal(extend(weights, points, np.ones(9, bool)), points)
    assert not rim[4]
