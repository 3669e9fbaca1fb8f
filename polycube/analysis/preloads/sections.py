"""Sections at which preloads, such as those of bolts, act: in hex meshes, and as cuts of splines.

A plane cuts some hexes. Those that are connected through cut faces form a layer across the solid.
The section consists of the inner faces of the layer beyond the plane. The displacement jumps there
by the tightening along the axis. The amounts follow from the condition that the work of the stress
in a unit jump, less that of the loads, is the preload: that is the resultant over the section.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix, eye
from scipy.sparse.csgraph import connected_components

from polycube.analysis.boundary_sets import sets_of_sides, trace
from polycube.analysis.constraints import Support
from polycube.analysis.continuous import Elasticity
from polycube.analysis.cyclic import Sector
from polycube.analysis.preloads.preload import Preload
from polycube.errors import InputError
from polycube.hexmesh.connectivity import FACES, PLACES, neighbours
from polycube.spline.boundary import boundary_nodes
from polycube.surface.measures import connected
from polycube.types import Spline

CORNERS = [0, 3, 15, 12, 48, 51, 63, 60]  # of the Bezier nodes of an element, in the order of VTK
TENSOR = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  # components of xx yy zz yz zx xy
GRID = np.stack(np.meshgrid(*[np.linspace(0, 1, 5)] * 3), axis=-1).reshape(-1, 1, 3)
TRILINEAR = np.where(PLACES, GRID, 1 - GRID).prod(axis=2)  # (125, 8) points in a hex
CLOSE = 0.13  # of the diagonal of a hex: a point in it is closer to one of these
NEAR = 64  # hexes with the closest middles, among which that of a point is sought
RIGID = 1e-9  # share of the stiffness of a jump alone: smaller ones are zero


def sections(
    points: np.ndarray,
    hexes: np.ndarray,
    preloads: Sequence[Preload],
    solid: np.ndarray | None = None,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Hexes and local faces (N, 2) of each section, and whether a hex is in its layer (E,).

    The layer is in front of the section, with the axis from there to behind it.

    points : (V, 3).  hexes : (E, 8).  solid : (E,) number of the solid of each, for an assembly
    Raises InputError if a section does not exist, or touches another one.
    """
    found, pairs, taken = [], np.stack(neighbours(hexes)), np.zeros(len(points), bool)
    one, other = np.concatenate([pairs, pairs[::-1]], axis=1)
    for preload in preloads:
        start = _hex_at(points, hexes, preload)
        height = (points - points[hexes[start]].mean(axis=0)) @ preload.direction
        beyond = (height > 0)[hexes][:, FACES]
        is_beyond = beyond.all(axis=2).ravel()
        first, second = pairs[:, (beyond.any(axis=2).ravel() & ~is_beyond)[pairs[0]]] // 6
        label = connected(first, second, len(hexes))
        layer = label == label[start]
        faces = one[layer[one // 6] & ~layer[other // 6] & is_beyond[one]]
        section = np.stack(np.divmod(faces, 6), axis=1)
        vertices = hexes[section[:, :1], FACES[section[:, 1]]]
        if not len(faces):
            raise InputError(f"{preload} is at the end of the part, or in its only layer of hexes")
        if solid is not None and (solid[layer] != solid[start]).any():
            raise InputError(f"{preload} cuts several solids, whose meshes are joined there")
        if taken[vertices].any():
            raise InputError(f"{preload} has a section that touches that of another one")
        taken[vertices] = True
        found.append((section, layer))
    return found


def _hex_at(points: np.ndarray, hexes: np.ndarray, preload: Preload) -> int:
    corners = points[hexes]
    near = np.argsort(np.linalg.norm(corners.mean(axis=1) - preload.point, axis=1))[:NEAR]
    off = np.linalg.norm(TRILINEAR @ corners[near] - preload.point, axis=2).min(axis=1)
    size = np.linalg.norm(np.ptp(corners[near], axis=1), axis=1)
    if (off > CLOSE * size).all():
        raise InputError(f"{preload} is not in the part: its point must be inside the solid")
    return int(near[(off / size).argmin()])


@dataclass(frozen=True, eq=False)
class Cut:
    """A spline with a second Bezier node for each one on the sections, for the layer in front."""

    preloads: Sequence[Preload]
    spline: Spline  # with the additional nodes at the end
    copies: csr_matrix  # (B', B) nodes of the whole spline for these
    jumps: np.ndarray  # (K, B', 3) displacements that jump by the axis at one of the sections
    faces: list[np.ndarray]  # (N, 2) of each section

    @classmethod
    def of(
        cls,
        spline: Spline,
        preloads: Sequence[Preload],
        supports: Sequence[Support],
        sector: Sector | None = None,
        solid: np.ndarray | None = None,
    ) -> Cut:
        """The cut of a spline; `solid` is as for `sections`.

        Raises InputError if a section does not exist or meets a support.
        """
        points, hexes = spline.extraction @ spline.control, spline.nodes[:, CORNERS]
        if not preloads:
            return cls((), spline, eye(len(points), format="csr"), np.zeros((0, *points.shape)), [])
        found, pairs = sections(points, hexes, preloads, solid), np.stack(neighbours(hexes))
        nodes, origin, size = spline.nodes.copy(), np.arange(len(points)), len(points)
        for section, layer in found:
            table = np.arange(size)
            own = np.unique(boundary_nodes(_with_sides(spline, section)))
            table[own] = len(origin) + np.arange(len(own))
            nodes[layer], origin = table[nodes[layer]], np.append(origin, own)
        sets = spline.sets or sets_of_sides(spline)
        extraction, alone = spline.extraction[origin], spline.place[:0]
        torn = replace(spline, nodes=nodes, extraction=extraction, sets=sets, place=alone)
        is_shared = (np.bincount(spline.places) > 1)[spline.places]  # with another solid
        jumps = np.zeros((len(preloads), len(origin), 3))
        for jump, preload, (section, _) in zip(jumps, preloads, found, strict=True):
            held = is_shared[origin]
            held[np.isin(origin, [] if sector is None else sector.nodes)] = True
            for support in supports:
                if preload.direction[list(support.components)].any():
                    held[support.nodes(torn)] = True
            front = np.unique(boundary_nodes(_with_sides(torn, section)))
            inside = ~np.isin(pairs, section @ [6, 1]).any(axis=0)
            ends = np.ones(inside.sum()), tuple(pairs[:, inside] // 6)
            joined = csr_matrix(ends, (len(hexes), len(hexes)))
            step = _step(torn, joined, (front, origin[front]), held)
            if step is None:
                raise InputError(
                    f"{preload} has a section at a support, at a cut face, at another solid, at a "
                    "border between refined and other hexes, or with too few hexes around it; "
                    "move the point"
                )
            jump += step[:, None] * preload.direction
        copies = csr_matrix((np.ones(len(origin)), (np.arange(len(origin)), origin)))
        return cls(preloads, torn, copies, jumps, [section for section, _ in found])

    def tightening(
        self, elasticity: Elasticity, fields: Sequence[np.ndarray], load: np.ndarray, newtons: float
    ) -> np.ndarray:
        """(1 + K,) factors of displacements, the first 1, for which each section has its preload.

        fields : (B', 3) displacement under the loads, then that for a unit of tightening of each
        load : (B', 3) forces of the loads, in units of `newtons`
        Raises InputError if a tightening causes no force.
        """
        if not self.preloads:
            return np.ones(1)
        resisting = np.array([elasticity.forces(field) for field in (*fields, *self.jumps)])
        resisting[0] -= load
        work = np.einsum("kbi,lbi->kl", self.jumps, resisting)
        rest, work, alone = np.split(work, [1, len(fields)], axis=1)
        scale = np.sqrt(np.diag(alone))
        if (np.linalg.eigvalsh(work / np.outer(scale, scale)) < RIGID).any():
            what = "a preload causes no force: nothing keeps the two sides of its section apart, or"
            raise InputError(f"{what} another one acts on the same bolt")
        given = [preload.force / newtons for preload in self.preloads]
        return np.append(1.0, np.linalg.solve(work, given - rest[:, 0]))

    def resultants(self, nodal: Spline, stress: np.ndarray) -> list[float]:
        """Integrals along the axes of the stress (B', 6) over the sections.

        nodal : the cut spline with a function for each Bezier node
        """
        found = []
        for preload, section in zip(self.preloads, self.faces, strict=True):
            here = trace(_with_sides(nodal, section), np.arange(len(section)))
            traction = (here.shape @ stress)[:, TENSOR] @ preload.direction
            found.append(float(here.area @ (traction * here.normals).sum(axis=1)))
        return found


def _with_sides(spline: Spline, faces: np.ndarray) -> Spline:
    return replace(spline, sides=faces, patch=faces[:, 0])


def _step(
    spline: Spline, joined: csr_matrix, sides: Sequence[np.ndarray], held: np.ndarray
) -> np.ndarray | None:
    """(B',) coefficients of a function that is larger by 1 in front of a section than behind it.

    It is the sum of the functions of the spline that do not vanish at the section, each on one
    side, so a displacement with a jump is as smooth as one without. None if that is impossible.

    joined : (E, E) elements with a common face that is not on the section
    sides : nodes on its two sides.  held : (B',) whether it must vanish at a node
    """
    found, shape, own = np.zeros(len(held)), spline.extraction.tocsc(), spline.element_functions()
    elements = csr_matrix((np.ones(len(own.functions)), own.functions, own.offsets)).tocsc()
    for function in np.unique(spline.extraction[sides[0]].indices):
        column, here = shape[:, [function]].tocoo(), elements[:, [function]].indices
        label = connected_components(joined[here][:, here], directed=False)[1]
        touching = (np.isin(spline.nodes[here], side).any(axis=1) for side in sides)
        front, back = (np.isin(label, label[touch]) for touch in touching)
        for sign, side in ((1, front), (-1, back)):
            inside = np.isin(column.row, spline.nodes[here[side]])
            rows = column.row[inside]
            if (front != back).all() and not held[rows].any():
                found[rows] += sign * column.data[inside]
                break
        else:
            return None
    return found
