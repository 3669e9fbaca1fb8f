"""Winding numbers at many points; distant triangles are approximated by a dipole.

Exact solid angles are used for near triangles, and the first term of the expansion of Barill et
al., *Fast winding numbers for soups and clouds*, SIGGRAPH 2018, for distant groups. The winding
number is 1 inside a closed surface, 0 outside, and between the two near a hole.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numba import njit

from polycube.numerics.threads import parts, side_by_side
from polycube.surface.closest import Tree, tree
from polycube.surface.measures import area_vectors
from polycube.types import TriMesh

FAR = 2.5  # distance beyond which a group is a dipole, in radii of the group
LEAST = 1000  # smallest number of points for a thread


def winding_numbers(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """(N,) winding numbers of the surface at points (N, 3), within about 0.04."""
    corners = surface.vertices[surface.faces]
    boxes = tree(corners, np.zeros((len(corners), 3)))
    groups = _groups(boxes, area_vectors(surface))
    found = side_by_side(
        [partial(_sum, boxes, *groups, points[p]) for p in parts(len(points), LEAST)]
    )
    return np.concatenate(found)


@njit(cache=True)
def _groups(boxes: Tree, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Area vector (M, 3), area centroid (M, 3) and radius (M,) of each node of the tree."""
    n = len(boxes.first)
    normal, middle, radius, weight = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    for node in range(n - 1, -1, -1):
        if boxes.right[node] == 0:
            for f in boxes.order[boxes.first[node] : boxes.last[node]]:
                area = np.sqrt((vectors[f] ** 2).sum())
                normal[node] += vectors[f]
                weight[node] += area
                for corner in range(3):
                    middle[node] += area * boxes.corners[f, corner] / 3
        else:
            for child in (node + 1, boxes.right[node]):
                normal[node] += normal[child]
                weight[node] += weight[child]
                middle[node] += weight[child] * middle[child]
        low, high = boxes.box[node, :3], boxes.box[node, 6:9]
        middle[node] = middle[node] / weight[node] if weight[node] > 0 else (low + high) / 2
        reach = np.maximum(high - middle[node], middle[node] - low)
        radius[node] = np.sqrt((reach**2).sum())
    return normal, middle, radius


@njit(cache=True, nogil=True, error_model="numpy")
def _sum(
    boxes: Tree, normal: np.ndarray, middle: np.ndarray, radius: np.ndarray, points: np.ndarray
) -> np.ndarray:
    result = np.zeros(len(points))
    stack = np.zeros(128, np.int64)
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        angle, top = 0.0, 1
        stack[0] = 0
        while top > 0:
            top -= 1
            node = stack[top]
            x, y, z = middle[node, 0] - px, middle[node, 1] - py, middle[node, 2] - pz
            away = np.sqrt(x * x + y * y + z * z)
            if away > FAR * radius[node]:
                flux = normal[node, 0] * x + normal[node, 1] * y + normal[node, 2] * z
                angle += flux / away**3
            elif boxes.right[node] == 0:
                for f in boxes.order[boxes.first[node] : boxes.last[node]]:
                    angle += _solid_angle(boxes.corners[f], px, py, pz)
            else:
                stack[top], stack[top + 1] = boxes.right[node], node + 1
                top += 2
        result[i] = angle / (4 * np.pi)
    return result


@njit(cache=True, error_model="numpy")
def _solid_angle(t: np.ndarray, px: float, py: float, pz: float) -> float:
    """Solid angle of a triangle, after van Oosterom and Strackee."""
    ax, ay, az = t[0, 0] - px, t[0, 1] - py, t[0, 2] - pz
    bx, by, bz = t[1, 0] - px, t[1, 1] - py, t[1, 2] - pz
    cx, cy, cz = t[2, 0] - px, t[2, 1] - py, t[2, 2] - pz
    a = np.sqrt(ax * ax + ay * ay + az * az)
    b = np.sqrt(bx * bx + by * by + bz * bz)
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    above = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = (
        a * b * c
        + (ax * bx + ay * by + az * bz) * c
        + (bx * cx + by * cy + bz * cz) * a
        + (cx * ax + cy * ay + cz * az) * b
    )
    return 2 * np.arctan2(above, below)
