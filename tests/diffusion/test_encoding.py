"""Points, images, contexts: exact and reversible."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.diffusion.encoding import by_x, image_size, learning_frame, to_pixels, to_points


@pytest.mark.parametrize(
    ("grid", "size"),
    [((2, 1, 1), (32, 32)), ((1, 1, 1), (16, 32)), ((3, 2, 1), (48, 64)), ((2, 2, 2), (64, 64))],
)
def test_image_size(grid: tuple, size: tuple) -> None:
    assert image_size(grid) == size


@settings(derandomize=True, max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 1024))
def test_an_image_has_the_points_of_the_model(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3)) * 40 + 100
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    frame = learning_frame(points, rotation)
    at = by_x(frame.apply(points))
    pixels = to_pixels(frame.apply(points), at, (32, 32))
    x = pixels.reshape(3, -1)[0, :n]
    assert (np.diff(x) >= -1e-6).all() and x[-1] <= 1 + 1e-6  # x is compared rounded
    assert not pixels.reshape(3, -1)[:, n:].any()
    assert np.abs(frame.invert(to_points(pixels, at)) - points).max() < 1e-4


def test_batches_keep_the_order_of_each_member() -> None:
    points = np.random.default_rng(0).normal(size=(3, 512, 3)).astype(np.float32)
    at = by_x(points)
    pixels = to_pixels(points, at, (16, 32))
    assert pixels.shape == (3, 3, 16, 32)
    assert np.array_equal(to_points(pixels, at), points)
    assert np.array_equal(pixels[1], to_pixels(points[1], at[1], (16, 32)))


@settings(derandomize=True, max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 200))
def test_the_order_is_a_permutation_of_each_member(seed: int, n: int) -> None:
    points = np.random.default_rng(seed).uniform(-1.1, 1.1, (2, 3, n, 3))
    at = by_x(points)
    assert np.array_equal(np.sort(at, axis=-1), np.broadcast_to(np.arange(n), (2, 3, n)))
    assert np.array_equal(at[1, 2], by_x(points[1, 2]))


def test_equal_points_keep_their_order() -> None:
    assert by_x(np.full((5, 3), 0.3)).tolist() == [0, 1, 2, 3, 4]


def test_symmetric_points_keep_their_order_whatever_the_rounding_errors() -> None:
    """They had the order of errors of 1e-16, which differ from machine to machine."""
    rng = np.random.default_rng(4)
    points = np.repeat(rng.uniform(-1, 1, (30, 3)).round(5), 8, axis=0)  # eight with equal x
    moved = points + rng.uniform(-1e-12, 1e-12, points.shape)
    assert np.array_equal(by_x(points), by_x(moved))
