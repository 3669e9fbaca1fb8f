"""Points as images and contexts as vectors, the inputs of the network (paper, section 3.2).

Sample points in the learning frame are sorted and fill a 3-channel image row by row. In the
learning frame a geometry is centred and the longest edge of its bounding box is 2; a polycube is
centred on its grid with cell edge 1.
"""

from collections.abc import Sequence

import numpy as np

from polycube.types import Frame

POINTS_PER_CELL = 512


def learning_frame(points: np.ndarray, rotation: np.ndarray | None = None) -> Frame:
    """Frame in which the points (N, 3) are centred and their longest box edge is 2."""
    rotation = np.eye(3) if rotation is None else rotation
    turned = points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    scale = float((high - low).max() / 2)
    if not scale > 0:
        raise ValueError("points must not all coincide")
    return Frame(rotation, rotation.T @ (low + high) / 2, scale)


def image_size(grid: Sequence[int]) -> tuple[int, int]:
    """(height, width) for 512 points per grid cell, as square as multiples of 4 allow."""
    pixels = POINTS_PER_CELL * int(np.prod(grid))
    height = max(h for h in range(4, int(pixels**0.5) + 1, 4) if pixels % (4 * h) == 0)
    return height, pixels // height


def context_vector(
    context: Sequence[str | None], primitives: Sequence[str], n_cells: int
) -> np.ndarray:
    """(4 (K - 1) + 1,) float32 for K = primitives x cells: 1 at 4 (n_cells p + cell) for each.

    context : primitive of each cell, None for an empty one
    primitives : the names, in the order p
    """
    primitives = list(primitives)
    unknown = [name for name in context if name is not None and name not in primitives]
    if unknown:
        raise LookupError(f"no primitive named {unknown[0]!r}; have {', '.join(primitives)}")
    if len(context) != n_cells:
        raise ValueError(f"context must name {n_cells} cells; got {tuple(context)}")
    vector = np.zeros(context_length(len(primitives), n_cells), np.float32)
    for cell, name in enumerate(context):
        if name is not None:
            vector[4 * (n_cells * primitives.index(name) + cell)] = 1
    return vector


def context_length(n_primitives: int, n_cells: int) -> int:
    """Length of the context vector: 29 for four primitives on two cells."""
    return 4 * (n_primitives * n_cells - 1) + 1


def x_order(geometry: np.ndarray) -> np.ndarray:
    """(..., N) order of points (..., N, 3) by x, stable."""
    return np.argsort(geometry[..., 0], axis=-1, kind="stable")


def to_pixels(points: np.ndarray, order: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(..., C, height, width) float32 image of rows (..., N, C); pixels without a point are 0."""
    height, width = size
    n_points = order.shape[-1]
    if n_points > height * width:
        raise ValueError(f"{n_points} points do not fit an image of {height} x {width}")
    pixels = np.zeros((*points.shape[:-2], height * width, points.shape[-1]), np.float32)
    pixels[..., :n_points, :] = np.take_along_axis(points, order[..., None], axis=-2)
    return np.moveaxis(pixels, -1, -2).reshape(*points.shape[:-2], -1, height, width)


def to_points(pixels: np.ndarray, order: np.ndarray) -> np.ndarray:
    """(..., N, C) rows of images (..., C, height, width), in the order before sorting."""
    flat = np.moveaxis(pixels.reshape(*pixels.shape[:-2], -1), -1, -2)
    points = np.empty((*order.shape, flat.shape[-1]), pixels.dtype)
    np.put_along_axis(points, order[..., None], flat[..., : order.shape[-1], :], axis=-2)
    return points
