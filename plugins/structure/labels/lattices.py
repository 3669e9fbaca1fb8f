"""A part in its frames, and candidates from bricks: a rough map fitted to positions on them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, diags, identity, kron, vstack

from polycube.numerics.factorization import factorize
from polycube.structure.lattice import of_bricks
from polycube.structure.rough_map import weights
from polycube.surface import closest
from polycube.surface.frames import frames
from polycube.surface.measures import diagonal, face_normals, genus
from polycube.types import Candidate, PerAxis, RoughMap, TriMesh

from ..slices.candidates import structure_key

SPACING = 0.08  # spacing of the control planes, in diagonals
MOST = 4  # largest number of control intervals between two knots
CONTROLS = 20_000  # largest number of control positions
MIXED = 0.5  # weight of mixed differences relative to second ones
ON = 1e-4  # largest distance from the surface, in bricks, of control positions on it
EXACT = 100.0  # weight of these relative to the mean over the surface
LEAST = 1e-10  # weight of the centre, which makes the problem definite


class View(NamedTuple):
    """A part in one of its frames."""

    number: int  # number of the frame
    surface: TriMesh  # in the frame, of diagonal 1
    place: np.ndarray  # (3, 3) from the frame to the part: row vectors times this
    genus: int


def views(surface: TriMesh, limit: int) -> Iterator[View]:
    """The part in its frames, the best first."""
    size, handles = diagonal(surface), genus(surface)
    for number, frame in enumerate(frames(surface)[:limit]):
        turned = TriMesh(surface.vertices @ frame.T / size, surface.faces, surface.region)
        yield View(number, turned, frame * size, handles)


class OnBricks(NamedTuple):
    """A surface on a lattice of bricks."""

    full: np.ndarray  # (X, Y, Z) bool
    knots: list[np.ndarray]  # their positions along the axes, in the frame
    surface: TriMesh  # in the frame
    placed: np.ndarray  # (V, 3) positions of its vertices in knot numbers

    def candidate(
        self, proposal: str, view: View, smoothness: float, cost: float, brick: str
    ) -> Candidate:
        """The candidate of the bricks, each a primitive with the given name."""
        polycube = of_bricks(self.full, brick)
        placed = TriMesh(self.placed, self.surface.faces)
        rough_map = fitted(self.knots, placed, self.surface.vertices @ view.place, smoothness)
        key = structure_key(polycube, np.eye(3), view.number)
        return Candidate(proposal, polycube, rough_map, cost, key)


def fitted(
    knots: list[np.ndarray], placed: TriMesh, points: np.ndarray, smoothness: float
) -> RoughMap:
    """Least-squares fit of the control positions with small second and mixed differences.

    knots : (K,) positions along the axes, whose distances divide the differences
    placed : the surface in knot numbers
    points : (N, 3) its vertices in the part
    """
    u, v, w = controls(knots)
    pairs = zip((u, v, w), knots, strict=True)
    x, y, z = (np.interp(line, np.arange(len(k)), k) for line, k in pairs)
    shape = (len(x), len(y), len(z))
    size = int(np.prod(shape))
    bending = _differences(shape, (x, y, z))
    matrix = weights((u, v, w), placed.vertices)
    lattice = np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3)
    # points of the lattice on the placed surface, and their positions in the part
    tree = closest.tree(placed.vertices[placed.faces], face_normals(placed))
    nearest, face, share = closest.closest(tree, lattice)
    node = np.flatnonzero(np.linalg.norm(nearest - lattice, axis=1) < ON)
    goal = np.einsum("nk,nkd->nd", share, points[placed.faces[face]])[node]
    middle = points.mean(axis=0)
    normal = matrix.T @ matrix / len(points) + smoothness / size * (bending.T @ bending)
    pull = np.full(size, LEAST)
    pull[node] += EXACT / size
    goals = np.zeros((size, 3))
    goals[node] = EXACT / size * (goal - middle)
    normal = normal + diags(pull)
    right = matrix.T @ (points - middle) / len(points) + goals
    positions = factorize(csr_matrix(normal), lattice).solve(right) + middle
    return RoughMap(u, v, w, positions.reshape(*shape, 3))


def controls(knots: list[np.ndarray]) -> PerAxis:
    """Control planes of each axis in knot numbers, within the largest number."""
    for most in range(MOST, 0, -1):
        x, y, z = (_control(line, most) for line in knots)
        if len(x) * len(y) * len(z) <= CONTROLS:
            break
    return x, y, z


def _control(knots: np.ndarray, most: int) -> np.ndarray:
    """Control planes: at each knot, and between distant knots."""
    parts = np.clip(np.round(np.diff(knots) / SPACING), 1, most).astype(int)
    inner = [k + np.arange(count) / count for k, count in enumerate(parts)]
    return np.append(np.concatenate(inner), float(len(parts)))


def _differences(shape: tuple[int, int, int], lengths: PerAxis) -> csr_matrix:
    """Rows of second differences along each axis and of mixed ones across each two."""
    unit = [identity(n, format="csr") for n in shape]
    first = [csr_matrix(np.diff(np.eye(n), axis=0)) for n in shape]
    second = [_second(line) for line in lengths]
    rows = []
    for axis in range(3):
        if shape[axis] > 2:
            parts = [second[a] if a == axis else unit[a] for a in range(3)]
            rows.append(kron(kron(parts[0], parts[1]), parts[2]))
        parts = [unit[a] if a == axis else first[a] for a in range(3)]
        rows.append(MIXED * kron(kron(parts[0], parts[1]), parts[2]))
    return vstack(rows).tocsr()


def _second(line: np.ndarray) -> csr_matrix:
    """(N - 2, N) change of slope at the inner points of a line, times their mean distance."""
    step = np.diff(line)
    mean = (step[1:] + step[:-1]) / 2
    rows = np.zeros((max(len(line) - 2, 0), len(line)))
    at = np.arange(len(rows))
    rows[at, at] = mean / step[:-1]
    rows[at, at + 1] = -mean / step[:-1] - mean / step[1:]
    rows[at, at + 2] = mean / step[1:]
    return csr_matrix(rows)
