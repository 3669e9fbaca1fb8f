"""Points as images and contexts as vectors, the inputs of the network (paper, section 3.2).

Sample points in the learning frame are sorted and fill a 3-channel image row by row. In the
learning frame a geometry is centred and the longest edge of its bounding box is 2; a polycube is
centred on its grid with cell edge 1.
"""

from collections.abc import Sequence

import numpy as np

from polycube.types import Frame

POINTS_PER_CELL = 512
EQUAL = 6  # decimals in which the x of points are compared
CENTRED = np.array([[-1.0] * 3, [1.0] * 3])  # box of geometries: centred, with longest edge 2


def learning_frame(
    points: np.ndarray, rotation: np.ndarray | None = None, box: np.ndarray = CENTRED
) -> Frame:
    """Frame in which the box of points (N, 3) has the centre and the longest edge of another.

    box : (2, 3) lowest and highest corner
    """
    rotation = np.eye(3) if rotation is None else rotation
    turned = points @ rotation.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    scale = float((high - low).max() / np.ptp(box, axis=0).max())
    if not scale > 0:
        raise ValueError("points must not all coincide")
    return Frame(rotation, rotation.T @ ((low + high) / 2 - scale * box.mean(axis=0)), scale)


def box_of(grid: Sequence[int], context: Sequence[str | None], pads: bool) -> np.ndarray:
    """(2, 3) box of the geometries of a context, see `learning_frame`.

    pads : the box of the occupied cells on the centred grid, as published; otherwise edge 2
    """
    if not pads:
        return CENTRED
    cells = np.argwhere(np.array([name is not None for name in context]).reshape(grid))
    return np.stack([cells.min(axis=0), cells.max(axis=0) + 1]) - np.array(grid) / 2


def pixels_of(context: Sequence[str | None], pads: bool) -> np.ndarray:
    """(N,) numbers of the pixels that have a point: 512 for each cell, in the order of the cells.

    pads : only those of occupied cells, as published
    """
    used = [not pads or name is not None for name in context]
    return np.flatnonzero(np.repeat(used, POINTS_PER_CELL))


def image_size(grid: Sequence[int]) -> tuple[int, int]:
    """(height, width) for 512 points per grid cell, as square as multiples of 4 allow."""
    pixels = POINTS_PER_CELL * int(np.prod(grid))
    height = max(h for h in range(4, int(pixels**0.5) + 1, 4) if pixels % (4 * h) == 0)
    return height, pixels // height


def by_x(geometry: np.ndarray, pixels: np.ndarray | None = None) -> np.ndarray:
    """(..., N) pixel of each point (..., N, 3): pixels (..., N) in the order of x, stable.

    x is rounded, so that the order of symmetric points does not depend on rounding errors.

    pixels : default: the first N
    """
    rank = np.argsort(np.argsort(geometry[..., 0].round(EQUAL), axis=-1, kind="stable"), axis=-1)
    return rank if pixels is None else np.take_along_axis(pixels, rank, axis=-1)


def to_pixels(points: np.ndarray, at: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """(..., C, height, width) float32 image of rows (..., N, C); pixels without a point are 0.

    at : (..., N) pixel of each row, see `by_x`
    """
    height, width = size
    if at.max() >= height * width:
        raise ValueError(f"pixel {at.max()} is not in an image of {height} x {width}")
    pixels = np.zeros((*points.shape[:-2], height * width, points.shape[-1]), np.float32)
    np.put_along_axis(pixels, at[..., None], points, axis=-2)
    return np.moveaxis(pixels, -1, -2).reshape(*points.shape[:-2], -1, height, width)


def to_points(pixels: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(..., N, C) rows of images (..., C, height, width) at their pixels (..., N)."""
    flat = np.moveaxis(pixels.reshape(*pixels.shape[:-2], -1), -1, -2)
    return np.take_along_axis(flat, at[..., None], axis=-2)
