"""Sides of quads that lie on curves between CAD faces, and the faces that they bound.

Seen from outside, a curve has one CAD face on its left and one on its right. The sides of a
boundary quad are counter-clockwise. A side that runs along the curve bounds a quad of the left
face; a side that runs against it bounds a quad of the right face. The result does not depend on the
size of the quads, although points inside a coarse quad may be closer to the other face.
"""

import numpy as np

from polycube.surface import closest
from polycube.surface.fit_target import Target
from polycube.surface.measures import between_faces, half_edges, unit

# positions along a side that are compared with the curve
SHARES = np.array([0, 1 / 6, 1 / 2, 5 / 6, 1])
# tolerance of their distance, as a share of the side length (octagon: 0.1)
OFF = np.array([0.05, 0.15, 0.15, 0.15, 0.05])
INNER = slice(1, 4)  # positions away from the ends, where other curves may be as close
MIDDLE, ALL = slice(2, 3), slice(0, 5)
ALONG = 0.85  # smallest cosine between side and curve (octagon: 0.92)
SUITS = 0.5  # smallest cosine between the normals of quad and CAD face


def bounded_faces(
    goal: Target, region: np.ndarray, corners: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """CAD face that each side of each quad bounds.

    Returns (Q, 4) CAD face for each side of the quad, from corner k to the next; 0 if the side is
    not on a curve, or if the normals of quad and face differ too much.

    region : (F,) CAD face of each triangle of the surface, from 1
    corners : (Q, 4, 3) corners of the quads at unit scale, counter-clockwise from outside
    normals : (Q, 3) unit normals of the quads
    """
    first, second = between_faces(goal.surface, region)
    if not len(first):
        return np.zeros(corners.shape[:2], np.int64)
    pair = np.stack([first, second], axis=1) // 3  # triangles on the left and on the right
    segments = goal.surface.vertices[half_edges(goal.surface.faces)[first]]
    direction = unit(segments[:, 1] - segments[:, 0])
    tree = closest.tree(segments[:, [0, 1, 1]], direction)
    start, along = corners.reshape(-1, 3), (np.roll(corners, -1, axis=1) - corners).reshape(-1, 3)
    reach = OFF * np.linalg.norm(along, axis=1)[:, None]  # (4 Q, 5)
    side = np.arange(len(start))
    for places in (MIDDLE, ALL):  # the first test excludes most sides
        points = start[side, None] + SHARES[places, None] * along[side, None]
        foot, curve, _ = closest.closest(tree, points.reshape(-1, 3))
        off = np.linalg.norm(points - foot.reshape(points.shape), axis=-1)
        is_near = (off <= reach[side][:, places]).all(axis=1)
        side, curve = side[is_near], curve.reshape(off.shape)[is_near]
    curve = curve[:, INNER]
    cosine = np.einsum("nd,nsd->ns", unit(along[side]), direction[curve])
    # triangle on the quad's side of the curve
    own = np.where(cosine > 0, pair[curve, 0], pair[curve, 1])
    face, beyond = region[own], np.where(cosine > 0, region[pair[curve, 1]], region[pair[curve, 0]])
    fits = np.einsum("nd,nsd->ns", normals[side // 4], goal.normals[own]) > SUITS
    fits &= (abs(cosine) >= ALONG) & (face == face[:, :1]) & (beyond == beyond[:, :1])
    found = np.zeros(len(start), np.int64)
    found[side] = np.where(fits.all(axis=1), face[:, 0], 0)
    return found.reshape(corners.shape[:2])
