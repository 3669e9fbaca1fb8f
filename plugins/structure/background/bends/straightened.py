"""Parts with round bends, such as flanged elbows: straightened, and bent back."""

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.curves import SHORT, Sizes
from polycube.hexmesh.background.motion import Motion, edges_in_bend, rotation
from polycube.surface import measures
from polycube.types import TriMesh

from .path import PAST, PLANE, between

SAME = 1e-2  # sine, and share of the diagonal: tolerance for the axes of faces of one bend
NEARLY = 5e-3  # of the diagonal: distance of the border of a bend from the planes at its ends
PLANAR = 1e-4  # the same for the parts beside it


class Straightened(NamedTuple):
    """A part whose bends are straight."""

    surface: TriMesh
    axis: np.ndarray  # (3,) unit vector along it
    motions: list[Motion]  # of the bends, in their order along the axis

    def bend(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 3) of the part for those of the straight part."""
        height = points @ self.axis
        for motion in reversed(self.motions):
            far = np.clip(height - motion.centre @ self.axis, 0, motion.length)
            points = motion.move(points - np.multiply.outer(far, self.axis), far / motion.length)
        return points

    def layers(self, levels: np.ndarray, number: np.ndarray, sizes: Sizes) -> np.ndarray:
        """(K,) numbers of layers between levels (K + 1,), increased where they are in a bend."""
        x, middle = self.surface.vertices, (levels[1:] + levels[:-1]) / 2
        for motion in self.motions:
            centre = motion.centre @ self.axis + motion.length / 2
            far = (0.5 + PAST) * motion.length
            inside, own = (abs(at - centre) < far for at in (middle, x @ self.axis))
            radius = float(((x[own] - motion.centre) @ motion.ahead).max())
            wanted = np.diff(levels) / motion.length * edges_in_bend(sizes, radius, motion.angle)
            number = np.where(inside, np.maximum(number, np.ceil(wanted - SHORT)), number)
        return number.astype(int)


def straightened(surface: TriMesh) -> Straightened | None:
    """A part with its bends straight, None if it has none; lengths in the middle are kept.

    A bend is a set of faces that a rotation moves along themselves, between two planes through its
    axis. It must separate the rest of the part into what is before and what is beyond it.

    Raises NoBackgroundError if bends branch or form a ring, or if a part reaches beside a bend.
    """
    if not len(surface.region):
        return None
    one, two = measures.between_faces(surface)
    faces = surface.region[np.stack([one // 3, two // 3], axis=1)]
    ends = measures.half_edges(surface.faces)[one]
    piece, first_bend = _pieces(surface, ends, faces)
    sides, of = piece[faces], piece[surface.region]
    pairs = np.unique(np.sort(sides[sides[:, 0] != sides[:, 1]], axis=1), axis=0)
    leaves = np.flatnonzero(np.bincount(pairs.ravel(), minlength=1)[:first_bend] == 1)
    if not len(leaves):
        return None
    x, near = surface.vertices.copy(), PLANAR * measures.diagonal(surface)
    done, axis, motions = leaves[:1], np.zeros(3), list[Motion]()
    while not np.isin(of, done).all():
        is_done = np.isin(sides, done)
        here = is_done[:, 0] != is_done[:, 1]
        after = np.unique(sides[here][~is_done[here]])
        if len(after) > 1:
            raise NoBackgroundError("its bends branch")
        if after[0] >= first_bend:
            wall = of == after[0]
            last = (sides == after[0]).any(axis=1) & ~(here | (sides == after[0]).all(axis=1))
            if not last.any():
                raise NoBackgroundError("its bends form a ring")
            before = np.unique(surface.faces[np.isin(of, done)])
            moved = np.setdiff1d(surface.faces, before)
            if not motions:
                centre = x[ends[here]].mean(axis=(0, 1))
                axis = np.linalg.svd(x[np.unique(ends[here])] - centre, full_matrices=False)[2][2]
                axis *= np.sign((x[np.unique(surface.faces[wall])] - centre).sum(axis=0) @ axis)
            straight = TriMesh(x, surface.faces, region=surface.region)
            motion = next(between(straight, ends[here], axis, ends[last], wall))
            share = np.where(np.isin(moved, surface.faces[wall]), motion.share(x[moved]), 1)
            x[moved] = motion.move(x[moved], -share)
            x[moved] += np.multiply.outer(share * motion.length, axis)
            motions.append(motion)
            beyond = np.unique(surface.faces[~(wall | np.isin(of, done))])
            low, high = ((x[each] - motion.centre) @ axis for each in (before, beyond))
            is_beside = low.max() > near or high.min() < motion.length - near
            if is_beside or abs(share - 0.5).max() > 0.5 + PAST:
                raise NoBackgroundError("a part beside a bend reaches beyond its end")
        done = np.append(done, after)
    return Straightened(TriMesh(x, surface.faces, region=surface.region), axis, motions)


def _pieces(surface: TriMesh, ends: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, int]:
    """(C,) bend of each CAD face, or part between bends, from the ends (E, 2) of edges between two
    faces (E, 2); and the number of the first bend.
    """
    x, count, size = surface.vertices, int(faces.max()) + 1, measures.diagonal(surface)
    bend, axes = np.full(count, -1), list[tuple[np.ndarray, np.ndarray]]()
    for face in np.flatnonzero(measures.curved_faces(surface, PLANE)).tolist():
        if (found := rotation(surface, surface.region == face)) is None:
            continue
        aside = [np.cross(spin, [found[0], (foot - found[1]) / size]) for spin, foot in axes]
        is_same = [bool((np.linalg.norm(off, axis=1) < SAME).all()) for off in aside]
        number = [*is_same, True].index(True)
        if number == len(axes):
            axes.append(found)
        bend[face] = number
    for number, (spin, foot) in enumerate(axes):
        border = np.unique(ends[(bend[faces] == number).sum(axis=1) == 1])
        out = (x[border] - foot) @ measures.frame(spin)[:2].T
        turn, radius = np.arctan2(*out.T), np.linalg.norm(out, axis=1)
        planes = 0
        while len(turn) and planes < 3:
            off = abs((turn - turn[0] + np.pi) % (2 * np.pi) - np.pi) * radius > NEARLY * size
            turn, radius, planes = turn[off], radius[off], planes + 1
        if planes != 2:
            bend[bend == number] = -1
    between_bends = faces[(bend[faces] < 0).all(axis=1)]
    own = measures.connected(between_bends[:, 0], between_bends[:, 1], count)
    return np.where(bend < 0, own, count + bend), count
