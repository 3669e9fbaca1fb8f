"""Spheres drawn with numpy: the pixels of all spheres, the nearest written last."""

from __future__ import annotations

import numpy as np

LIGHT = np.array([-0.45, 0.55, 0.7])  # right, up, towards the eye
SHARPNESS = 2  # samples along the edge of a pixel


def spheres(
    centres: np.ndarray,
    colours: np.ndarray,
    radius: np.ndarray,
    size: tuple[int, int],
) -> np.ndarray:
    """(height, width, 3) uint8 picture of shaded spheres on white.

    centres : (N, 3) pixels right and down from the top left corner, and towards the eye
    colours : (N, 3) 0..255
    radius : (N,) pixels, with few different values
    """
    parts = []
    for r in np.unique(radius):
        chosen = radius == r
        offset, normal = _disc(SHARPNESS * r)
        at = SHARPNESS * centres[chosen, None, :2] + offset
        depth = centres[chosen, None, 2] + r * normal[:, 2]
        lit = colours[chosen, None] * _shade(normal)[:, None] + _shine(normal)[:, None]
        parts.append((at.reshape(-1, 2), depth.ravel(), lit.reshape(-1, 3)))
    at, depth, lit = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    height, width = (SHARPNESS * side for side in size)
    x, y = at.astype(int).T
    inside = np.flatnonzero((x >= 0) & (x < width) & (y >= 0) & (y < height))
    order = inside[np.argsort(depth[inside])]
    picture = np.full((height, width, 3), 255, np.float32)
    # the last one of equal pixels is used
    picture[y[order], x[order]] = np.minimum(lit[order], 255)
    blocks = picture.reshape(size[0], SHARPNESS, size[1], SHARPNESS, 3)
    return blocks.mean(axis=(1, 3)).round().astype(np.uint8)


def _disc(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (P, 2) of a disc, and the unit normals (P, 3) of the sphere there: right, up, out."""
    reach = np.arange(-np.ceil(radius), np.ceil(radius) + 1)
    x, y = (a.ravel() for a in np.meshgrid(reach, reach))
    x, y = x[x**2 + y**2 <= radius**2], y[x**2 + y**2 <= radius**2]
    z = np.sqrt(radius**2 - x**2 - y**2)
    return np.stack([x, y], 1), np.stack([x, -y, z], 1) / radius


def _shade(normal: np.ndarray) -> np.ndarray:
    """(P,) brightness: ambient and diffuse light."""
    return 0.5 + 0.55 * np.maximum(normal @ LIGHT / np.linalg.norm(LIGHT), 0)


def _shine(normal: np.ndarray) -> np.ndarray:
    """(P,) highlight of Blinn, from the half-way direction between light and eye."""
    half = LIGHT / np.linalg.norm(LIGHT) + [0, 0, 1]
    return 90 * np.maximum(normal @ half / np.linalg.norm(half), 0) ** 30
