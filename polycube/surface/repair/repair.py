"""Repair a surface where that is asked for, and say what was changed and by how much.

`safe` changes no face that may stay: it leaves out debris and what hangs loose, parts what touches
in a point, and closes holes that are small or flat.  `aggressive` builds the surface anew
(`geometry/remesh.py`) where that was not enough, or where faces cross.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field

import numpy as np

from polycube.errors import InputError
from polycube.surface import measures as topology
from polycube.surface.closest import distance, tree
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import diagonal, place, volume
from polycube.surface.repair import clean
from polycube.surface.repair.defects import spans_of
from polycube.surface.repair.holes import MAX_LOOP, filling, flatness, loops, nested
from polycube.surface.repair.remesh import remesh
from polycube.surface.winding import fast_winding_numbers
from polycube.types import TriMesh

LEVELS = ("off", "safe", "aggressive")
HOLE = 0.1  # of the diagonal: a hole no wider is closed
FLAT_HOLE = 1e-3  # of its diagonal: a hole that leaves its plane no more is closed
DEBRIS = 0.01  # of the largest piece's diagonal: a piece no wider is left out
VOID = 0.01  # of the volume: a void no larger is filled; `aggressive` closes and fills any
CELL = 1 / 80  # of the diagonal: width of the cells of `aggressive`
SKIN = 1e-3  # of the diagonal: how far beside a face winding numbers are compared
ROUNDING = 1e-8  # of the diagonal: distances below are those of rounding
SAMPLES = 50_000  # points at most that measure the deviation, each way


@dataclass(frozen=True)
class Repair:
    """What a repair did; lengths and volumes in the user's units."""

    level: str
    changes: tuple[str, ...]
    cell: float | None = None  # width of the cells of a surface that was built anew
    deviation: float = 0.0  # largest distance between the surface given and the repaired one
    deviation_percent: float = 0.0  # of the diagonal
    added: float = 0.0  # largest distance from the repaired surface to that given
    lost: float = 0.0  # and back, of faces between inside and outside
    volume_before: float = 0.0  # with its holes as they are
    volume_after: float = 0.0

    def numbers(self) -> dict[str, object]:
        """For `report.json`."""
        return {**asdict(self), "changes": list(self.changes)}

    def sentence(self) -> str:
        """What changed, how much."""
        if not self.changes:
            return f"repair={self.level}: there was nothing to repair"
        grown = self.volume_after / self.volume_before - 1 if self.volume_before else np.nan
        return (
            f"repaired ({self.level}): {'; '.join(self.changes)}; deviates by at most "
            f"{self.deviation:.3g} ({self.deviation_percent:.2g} % of the diagonal), "
            f"volume {100 * grown:+.2g} %"
        )


@dataclass
class _Work:
    surface: TriMesh
    changes: list[str] = field(default_factory=list)

    def do(self, step: Callable[[TriMesh], clean.Step]) -> None:
        self.surface, done = step(self.surface)
        self.changes += done


def repaired(vertices: np.ndarray, faces: np.ndarray, level: str) -> tuple[TriMesh, Repair]:
    """The boundary of one solid; raises InputError where the level does not lead to one."""
    work = _Work(*finite(vertices, faces))
    for step in (clean.weld_equal, _weld_near, clean.drop_repeated, clean.drop_flat):
        work.do(step)
    for step in (_drop_fins, _drop_debris, _orient):
        work.do(step)
    given, is_bold = work.surface, level == "aggressive"
    work.do(lambda surface: _close_holes(surface, np.inf if is_bold else HOLE))
    work.do(_part_touching)
    work.do(_orient)
    work.do(lambda surface: _fill_voids(surface, np.inf if is_bold else VOID))
    cell = None
    if is_bold and _is_wrong(work.surface):
        cell = CELL * diagonal(work.surface)
        work.do(lambda surface: _anew(surface, cell))
    topology.check_closed(work.surface)
    work.do(clean.flip_flat)
    topology.check_surface(work.surface)
    return work.surface, _measured(given, work.surface, level, work.changes, cell)


def finite(vertices: np.ndarray, faces: np.ndarray) -> clean.Step:
    """Leave out faces with corners that are no numbers; refuse what is no geometry."""
    notes = []
    if len(faces) and faces.min() >= 0 and faces.max() < len(vertices):
        strange = ~np.isfinite(vertices).all(axis=1)
        hit = strange[faces].any(axis=1)
        if strange.any() and not hit.all():
            faces = faces[~hit]
            used, faces = np.unique(faces, return_inverse=True)
            vertices, faces = vertices[used], faces.reshape(-1, 3)
            notes = [
                f"left out vertices that are not finite: {strange.sum()}, with {hit.sum()} faces"
            ]
    surface, more = clean.checked(vertices, faces)
    return surface, notes + more


def _weld_near(surface: TriMesh) -> clean.Step:
    return (surface, []) if topology.is_closed(surface.faces) else clean.weld_near(surface)


def _drop_fins(surface: TriMesh) -> clean.Step:
    """Leave out faces that hang with an open edge on an edge of more than two faces."""
    faces, kept = surface.faces, np.ones(len(surface.faces), dtype=bool)
    while True:
        _, count, edge = topology.edges(faces[kept])
        on = count[edge].reshape(-1, 3)
        fin = (on == 1).any(axis=1) & (on > 2).any(axis=1)
        if not fin.any():
            break
        kept[np.flatnonzero(kept)[fin]] = False
    return _without(surface, ~kept, "that hang loose on an edge")


def _drop_debris(surface: TriMesh) -> clean.Step:
    piece = topology.components(surface.faces)
    spans = spans_of(surface, piece)
    return _without(surface, (spans < DEBRIS * spans.max())[piece], "of debris")


def _without(surface: TriMesh, faces: np.ndarray, why: str) -> clean.Step:
    if not faces.any():
        return surface, []
    used, kept = np.unique(surface.faces[~faces], return_inverse=True)
    left = TriMesh(surface.vertices[used], kept.reshape(-1, 3))
    return left, clean.left_out(surface, faces, why)


def _part_touching(surface: TriMesh) -> clean.Step:
    """Give each fan of faces around a vertex its own vertex, at the same place."""
    if not topology.is_closed(surface.faces):
        return surface, []
    touching = topology.nonmanifold_vertices(surface.faces)
    if not len(touching):
        return surface, []
    fan = topology.fans(surface.faces)
    _, first, corner = np.unique(fan, return_index=True, return_inverse=True)
    vertices = surface.vertices[surface.faces.ravel()[first]]
    where = place(surface, surface.vertices[touching[0]])
    note = f"parted vertices where surfaces touch: {len(touching)}, the first at {where}"
    return TriMesh(vertices, corner.reshape(-1, 3)), [note]


def _orient(surface: TriMesh) -> clean.Step:
    if len(topology.nonmanifold_edges(surface.faces)):
        return surface, []
    return clean.orient(surface)


def _close_holes(surface: TriMesh, widest_closed: float) -> clean.Step:
    """Close holes that are flat, or no wider than so much of the diagonal."""
    faces = surface.faces
    if not len(topology.open_edges(faces)) or len(topology.nonmanifold_edges(faces)):
        return surface, []
    found = loops(faces)
    alone = ~nested(surface, found)
    patches, edges, widest = [], 0, 0.0
    for loop, is_alone in zip(found, alone, strict=True):
        points = surface.vertices[loop]
        width = float(np.linalg.norm(np.ptp(points, axis=0)))
        small = width <= widest_closed * diagonal(surface)
        flat = len(loop) > 3 and flatness(points) <= FLAT_HOLE
        if 3 <= len(loop) <= MAX_LOOP and (small or len(loop) == 3 or (flat and is_alone)):
            patches.append(loop[filling(points)])
            edges, widest = edges + len(loop), max(widest, width)
    if not patches:
        return surface, []
    closed = TriMesh(surface.vertices, np.concatenate([faces, *patches]))
    added = len(closed.faces) - len(faces)
    return closed, [
        f"closed holes: {len(patches)} of {len(found)}, {edges} edges, {added} new faces, "
        f"the widest {100 * widest / diagonal(surface):.2g} % of the diagonal"
    ]


def _fill_voids(surface: TriMesh, largest: float) -> clean.Step:
    """Leave out pieces inside the largest one."""
    piece = topology.components(surface.faces)
    spans = spans_of(surface, piece)
    if len(spans) == 1 or not topology.is_closed(surface.faces):
        return surface, []
    shells = [TriMesh(surface.vertices, surface.faces[piece == p]) for p in range(len(spans))]
    outer = shells[int(spans.argmax())]
    if volume(outer) == 0:
        return surface, []
    gone, sizes = np.zeros(len(spans), dtype=bool), []
    for p, shell in enumerate(shells):
        size = abs(volume(shell) / volume(outer))
        probes = surface.vertices[np.unique(shell.faces)]
        if shell is not outer and size <= largest:
            gone[p] = (np.abs(fast_winding_numbers(outer, probes)) > 0.5).all()
            sizes += [size] * int(gone[p])
    left, notes = _without(surface, gone[piece], "of inner voids")
    share = 100 * sum(sizes)
    return left, [f"{note}; {len(sizes)} filled, {share:.2g} % of the volume" for note in notes]


def _is_wrong(surface: TriMesh) -> bool:
    try:
        topology.check_surface(surface)
    except InputError:
        return True
    return len(self_intersections(surface)) > 0


def _anew(surface: TriMesh, cell: float) -> clean.Step:
    """The surface built anew on cells, each of its pieces turned outward before."""
    built = remesh(_outward(surface), cell)
    notes = [
        f"built anew on cells of {cell:.3g}: what is thinner is lost, all that overlaps is one; "
        f"faces {len(surface.faces)} -> {len(built.faces)}"
    ]
    for step in (_drop_debris, lambda s: _fill_voids(s, np.inf)):
        built, done = step(built)
        notes += done
    if topology.is_closed(surface.faces):
        handles = topology.genus(surface), topology.genus(built)
        notes += ["genus {} -> {}".format(*handles)] * (handles[0] != handles[1])
    return built, notes


def _outward(surface: TriMesh) -> TriMesh:
    piece = topology.components(surface.faces)
    faces = surface.faces.copy()
    for p in range(piece.max() + 1):
        own = piece == p
        if volume(TriMesh(surface.vertices, faces[own])) < 0:
            faces[own] = faces[own][:, ::-1]
    return TriMesh(surface.vertices, faces)


def _measured(
    given: TriMesh, made: TriMesh, level: str, changes: list[str], cell: float | None
) -> Repair:
    size = diagonal(made)
    added = _farthest(made, given)
    lost = _farthest(given, made, None if cell is None else SKIN * size)
    added, lost = (0.0 if away < ROUNDING * size else away for away in (added, lost))
    apart = max(added, lost)
    before = abs(volume(given))
    return Repair(
        level, tuple(changes), cell, apart, 100 * apart / size, added, lost, before, volume(made)
    )


def _farthest(one: TriMesh, other: TriMesh, skin: float | None = None) -> float:
    """Largest distance of `one` from `other`; with `skin` only where one side of it is solid."""
    corners = one.vertices[one.faces]
    points = np.concatenate([one.vertices[np.unique(one.faces)], corners.mean(axis=1)])
    normals = np.concatenate(
        [np.zeros((len(points) - len(corners), 3)), topology.face_normals(one)]
    )
    if skin is not None:
        points, normals = points[-len(corners) :], normals[-len(corners) :]
    every = len(points) // SAMPLES + 1
    points, normals = points[::every], normals[::every]
    if skin is not None:
        sides = [fast_winding_numbers(one, points + s * skin * normals) > 0.5 for s in (1, -1)]
        points = points[sides[0] != sides[1]]
    if not len(points):
        return 0.0
    triangles = other.vertices[other.faces]
    return float(distance(tree(triangles, np.zeros((len(triangles), 3))), points).max())
