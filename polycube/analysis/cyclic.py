"""Cyclic symmetry: the two cut faces of a sector, and the functions of a spline in pairs there.

The rotation R from a sector to the next maps one cut face onto the other. A displacement with the
symmetry of the whole has u(R x) = R u(x) there, a scalar field u(R x) = u(x).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csr_matrix, eye, hstack
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from polycube.analysis.problem import Cyclic
from polycube.errors import InputError
from polycube.spline.boundary import boundary_nodes, corner_nodes
from polycube.surface.measures import unit
from polycube.types import Spline

NEAR = 1.5  # of the mean edge of a quad: largest distance to the middle of one behind it
FLUSH = 0.1  # the same across the quad
CANDIDATES = 8  # closest quads among which one behind it is sought
OPPOSITE = -0.9  # largest cosine between their normals
CLOSE = 0.1  # of the mean edge: largest distance of a node from the image of its partner
EQUAL = 1e-9  # largest difference of the traces of a pair of functions
ZERO = 1e-9  # singular values that count as zero
ASYMMETRIC = 1e-6  # share of the largest prescribed value that counts as zero


@dataclass(frozen=True, eq=False)
class Sector:
    """Pairs on the cut faces of a spline; the rotation maps the first of a pair to the second."""

    cyclic: Cyclic
    functions: np.ndarray  # (P, 2)
    nodes: np.ndarray  # (N, 2) Bezier nodes

    @classmethod
    def of(cls, spline: Spline, cyclic: Cyclic) -> Sector:
        """The pairs of a spline; raises InputError if its cut faces do not match."""
        points, corners = spline.extraction @ spline.control, corner_nodes(spline)
        sides = cut_faces(points, corners, cyclic)
        first, second = (np.unique(boundary_nodes(spline)[side]) for side in sides)
        apart, image = cKDTree(points[second]).query(cyclic.turned(points[first]))
        off = apart.max() / _edge(points[corners[sides[0]]]).mean()
        if len(np.unique(image)) < max(len(first), len(second)) or off > CLOSE:
            raise InputError(
                f"the cut faces of the spline differ by up to {off:.2g} edges of quads, where "
                f"{CLOSE:g} is allowed; make the spline with analysis.cyclic, or from=spline"
            )
        nodes = np.stack([first, second[image]], axis=1)
        functions = _paired(*(spline.extraction[side] for side in nodes.T))
        return cls(cyclic, *(_once(pairs, cyclic) for pairs in (functions, nodes)))

    def check(self, values: np.ndarray) -> None:
        """Raise InputError unless prescribed values (C, n) of functions are symmetric."""
        first, second = (values[side] for side in self.functions.T)
        turned = first @ self.cyclic.turn.T if values.shape[1] == 3 else first
        if abs(second - turned).max() > ASYMMETRIC * abs(values).max():
            raise InputError(
                "the values prescribed at the two cut faces differ; where a support with a value "
                "touches them, the rotation of analysis.cyclic must not change its direction"
            )

    def basis(self, free: np.ndarray, pairs: np.ndarray) -> csr_matrix:
        """(n S, K) orthonormal basis of the symmetric fields.

        free : (S, n) whether a component of a function or node is free
        pairs : (P, 2) of these, `functions` or `nodes`
        """
        n = free.shape[1]
        turn, one = (self.cyclic.turn if n == 3 else np.eye(1)), np.eye(n)
        rows = np.zeros((len(pairs), 4 * n, 2 * n))  # that are zero for a symmetric field
        rows[:, :n] = np.hstack([-turn, one])
        rows[pairs[:, 0] == pairs[:, 1], n : 2 * n] = np.hstack([one, -one])
        each = np.arange(2 * n)
        rows[:, 2 * n + each, each] = ~free[pairs].reshape(-1, 2 * n)
        _, values, vectors = np.linalg.svd(rows)
        pair, _ = np.nonzero(values < ZERO)
        found = vectors[values < ZERO]
        columns = (n * pairs[pair][..., None] + each[:n]).ravel()
        ends = np.arange(len(found) + 1) * 2 * n
        both = csr_matrix((found.ravel(), columns, ends), (len(found), free.size))
        alone = free.copy()
        alone[pairs] = False
        return csr_matrix(hstack([eye(free.size, format="csc")[:, alone.ravel()], both.T]))


def matched(points: np.ndarray, quads: np.ndarray, cyclic: Cyclic) -> np.ndarray:
    """(N, 3) points of quads (Q, 4), with those of one cut face at the images of the other.

    Raises InputError if the quads of the cut faces are not connected alike.
    """
    first, second = (quads[side] for side in cut_faces(points, quads, cyclic))
    (own, local), others = np.unique(first, return_inverse=True), np.unique(second)
    apart = cdist(cyclic.turned(points[own]), points[others], "sqeuclidean")
    image = others[linear_sum_assignment(apart)[1]]
    if len(own) == len(others):
        faces = [np.sort(side, axis=1) for side in (image[local].reshape(-1, 4), second)]
        found, wanted = (np.unique(side, axis=0) for side in faces)
        if np.array_equal(found, wanted):
            first, second = _once(np.stack([own, image], axis=1), cyclic).T
            moved = points.copy()
            moved[second] = cyclic.turned(points[first])
            return moved
    raise InputError(
        f"the {len(first)} and {len(second)} quads of the two cut faces are not connected alike; "
        "if sectors, axis and point are right, another meshing.size or structure= may help"
    )


def cut_faces(
    points: np.ndarray, quads: np.ndarray, cyclic: Cyclic
) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the quads (Q, 4) of points (N, 3) on a cut face, and of those on its image.

    Raises InputError if there are none.
    """
    corners = points[quads]
    turned = cyclic.turned(corners)
    first, second = _behind(turned, corners), _behind(corners, turned)
    if not len(first) or not len(second):
        raise InputError(
            f"there are no cut faces: a rotation by 360/{cyclic.sectors} degrees maps no part of "
            f"the boundary onto another; the part must be one of {cyclic.sectors} equal sectors, "
            "and axis and point those of the whole"
        )
    return first, second


def _behind(corners: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(F,) quads, of corners (Q, 4, 3), that touch others (Q, 4, 3) from outside."""
    normal, facing = (
        unit(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])) for x in (corners, others)
    )
    middle, other = corners.mean(axis=1), others.mean(axis=1)
    apart, near = cKDTree(other).query(middle, min(CANDIDATES, len(other)))  # (Q, k)
    across = ((middle[:, None] - other[near]) * facing[near]).sum(axis=2)
    is_behind = (normal[:, None] * facing[near]).sum(axis=2) < OPPOSITE
    edge = _edge(others)[near]
    return np.flatnonzero((is_behind & (apart < NEAR * edge) & (abs(across) < FLUSH * edge)).any(1))


def _once(pairs: np.ndarray, cyclic: Cyclic) -> np.ndarray:
    """Pairs (P, 2) in one order; of two sectors, each is the image of the other."""
    return pairs[pairs[:, 0] <= pairs[:, 1]] if cyclic.sectors == 2 else pairs


def _edge(corners: np.ndarray) -> np.ndarray:
    """(Q,) mean length of the edges of quads with corners (Q, 4, 3)."""
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)


def _paired(first: csr_matrix, second: csr_matrix) -> np.ndarray:
    """(P, 2) columns that are equal in two matrices (N, C); raises InputError if some are not."""
    weights = np.random.default_rng(0).random(first.shape[0])
    sums = [weights @ side for side in (first, second)]
    columns = [np.flatnonzero(each > EQUAL) for each in sums]
    ordered = [own[np.argsort(each[own])] for own, each in zip(columns, sums, strict=True)]
    if len(ordered[0]) == len(ordered[1]):
        if abs(first[:, ordered[0]] - second[:, ordered[1]]).max() < EQUAL:
            return np.stack(ordered, axis=1)
    raise InputError(
        "the functions of the spline on the two cut faces are different; "
        "use spline=h2s, and from=spline if the spline was made without analysis.cyclic"
    )
