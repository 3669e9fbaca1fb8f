"""Quality measures of single hexes, as in finite-element programs, with the values of VTK.

A frame consists of the three edges at a corner; the principal axes are the sums of the four edges
along xi, eta and zeta. (Knupp 2003; Stimpson et al., The Verdict geometric quality library, 2007.)
VTK 9.7 omits the zeta edges in its edge ratio; here all twelve edges are used, as in its manual.
"""

import numpy as np

from polycube.hexmesh.connectivity import CORNERS, EDGES
from polycube.hexmesh.scaled_jacobian import scaled_jacobian

LARGEST = 1e30  # value of VTK for an unbounded measure: an edge without length, det <= 0
LEAST = 1e-30  # smaller values count as zero in VTK
CHUNK = 50_000  # hexes in one batch; 30 MB

# measure: value of a cube, which values are worse, and description
MEASURES = {
    "scaled_jacobian": (1.0, min, "least volume of a frame of unit edges; at most 0: inverted"),
    "edge_ratio": (1.0, max, "longest edge over the shortest"),
    "max_edge_ratio": (1.0, max, "longest principal axis over the shortest"),
    "skew": (0.0, max, "largest cosine between two principal axes"),
    "condition": (1.0, max, "largest condition number of a frame"),
    "shape": (1.0, min, "least 3 det^(2/3) / |frame|^2; 0: inverted"),
}


def metrics(vertices: np.ndarray, hexes: np.ndarray) -> dict[str, np.ndarray]:
    """(H,) values of each of MEASURES."""
    parts = [_chunk(vertices, part) for part in np.array_split(hexes, len(hexes) // CHUNK + 1)]
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return {"scaled_jacobian": scaled_jacobian(vertices, hexes), **found}


def worst(measure: str, values: np.ndarray, number: int = 5) -> np.ndarray:
    """The hexes (number,) with the worst values (H,), the worst first."""
    return np.argsort(values if MEASURES[measure][1] is min else -values, kind="stable")[:number]


def _chunk(vertices: np.ndarray, hexes: np.ndarray) -> dict[str, np.ndarray]:
    corners = vertices[hexes]
    edges = corners[:, EDGES[:, 1]] - corners[:, EDGES[:, 0]]
    axes = edges.reshape(-1, 3, 4, 3).sum(axis=2)
    frames = corners[:, CORNERS[:, 1:]] - corners[:, CORNERS[:, :1]]  # (H, 8, 3, 3)
    det = np.linalg.det(frames)
    square = np.einsum("hfij,hfij->hf", frames, frames)
    positive = det > LEAST
    shape = 3 * np.cbrt(np.where(positive, det, 0)) ** 2 / np.where(positive, square, 1)
    return {
        "edge_ratio": _ratio(np.linalg.norm(edges, axis=2)),
        "max_edge_ratio": _ratio(np.linalg.norm(axes, axis=2)),
        "skew": _skew(axes),
        "condition": _condition(frames, det, square),
        "shape": shape.min(axis=1),
    }


def _ratio(lengths: np.ndarray) -> np.ndarray:
    """(H,) ratio of the longest to the shortest of lengths (H, n)."""
    shortest = lengths.min(axis=1)
    return np.where(shortest > LEAST, lengths.max(axis=1) / np.maximum(shortest, LEAST), LARGEST)


def _skew(axes: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(axes, axis=2, keepdims=True)
    unit = axes / np.maximum(length, LEAST)
    cosine = np.abs(np.einsum("hid,hid->hi", unit, np.roll(unit, 1, axis=1))).max(axis=1)
    return np.where((length > LEAST).all(axis=(1, 2)), cosine, 0.0)


def _condition(frames: np.ndarray, det: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Largest |A| |A^-1| / 3 in the Frobenius norm; A^-1 from cross products and det."""
    a, b, c = np.moveaxis(frames, 2, 0)
    cross = sum(((np.cross(p, q)) ** 2).sum(axis=-1) for p, q in ((a, b), (b, c), (c, a)))
    number = np.sqrt(square * cross) / (3 * np.where(det > LEAST, det, 1))
    return np.minimum(np.where(det > LEAST, number, LARGEST), LARGEST).max(axis=1)
