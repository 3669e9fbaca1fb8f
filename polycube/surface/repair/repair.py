"""Repair a surface on request, and report the changes and their extent.

`safe` removes debris and loose faces, separates parts that touch at a point, and closes small or
flat holes; other faces stay unchanged. If this is not sufficient, or if faces cross, `aggressive`
rebuilds the surface (`remesh.py`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from polycube.errors import InputError
from polycube.surface import measures as topology
from polycube.surface.checks import check_closed, check_surface
from polycube.surface.closest import distance, tree
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import diagonal, volume
from polycube.surface.repair import clean, steps
from polycube.surface.repair.remesh import remesh
from polycube.surface.voxels import winding_numbers
from polycube.types import TriMesh

LEVELS = ("off", "safe", "aggressive")
HOLE = 0.1  # of the diagonal: holes up to this width are closed
VOID = 0.01  # of the volume: voids up to this size are filled; `aggressive` fills all of them
CELL = 1 / 80  # of the diagonal: cell width of `aggressive`
SKIN = 1e-3  # of the diagonal: distance from a face at which winding numbers are compared
ROUNDING = 1e-8  # of the diagonal: smaller distances are rounding errors
SAMPLES = 50_000  # largest number of points that measure the deviation, in each direction


@dataclass(frozen=True)
class Repair:
    """Changes made by a repair, as in `report.json`; lengths and volumes in model units."""

    level: str
    changes: tuple[str, ...]
    cell: float | None = None  # cell width if the surface was rebuilt
    deviation: float = 0.0  # largest distance between the given and the repaired surface
    deviation_percent: float = 0.0  # in per cent of the diagonal
    added: float = 0.0  # largest distance of the repaired surface from the given one
    lost: float = 0.0  # the reverse, for faces between inside and outside
    volume_before: float = 0.0  # with open holes
    volume_after: float = 0.0

    def sentence(self) -> str:
        """One sentence about the changes."""
        if not self.changes:
            return f"repair={self.level}: there was nothing to repair"
        grown = self.volume_after / self.volume_before - 1 if self.volume_before else np.nan
        return (
            f"repaired ({self.level}): {'; '.join(self.changes)}; deviates by at most "
            f"{self.deviation:.3g} ({self.deviation_percent:.2g} % of the diagonal), "
            f"volume {100 * grown:+.2g} %"
        )


def repaired(vertices: np.ndarray, faces: np.ndarray, level: str) -> tuple[TriMesh, Repair]:
    """The boundary of one solid; raises InputError if the repair level is not sufficient."""
    surface, changes = finite(vertices, faces)

    def do(*several: Callable[[TriMesh], clean.Step]) -> None:
        nonlocal surface
        for step in several:
            surface, done = step(surface)
            changes.extend(done)

    do(clean.weld_equal, steps.weld_near, clean.drop_repeated, clean.drop_flat)
    do(steps.drop_fins, steps.drop_debris, steps.orient)
    given, is_bold = surface, level == "aggressive"
    do(partial(steps.close_holes, widest_closed=np.inf if is_bold else HOLE))
    do(steps.part_touching, steps.orient)
    do(partial(steps.fill_voids, largest=np.inf if is_bold else VOID))
    cell = None
    if is_bold and _is_wrong(surface):
        cell = CELL * diagonal(surface)
        do(partial(_anew, cell=cell))
    check_closed(surface)
    do(clean.flip_flat)
    check_surface(surface)
    return surface, _measured(given, surface, level, changes, cell)


def finite(vertices: np.ndarray, faces: np.ndarray) -> clean.Step:
    """Remove faces with non-finite corners; raise InputError for invalid geometry."""
    notes = []
    if len(faces) and faces.min() >= 0 and faces.max() < len(vertices):
        strange = ~np.isfinite(vertices).all(axis=1)
        hit = strange[faces].any(axis=1)
        if strange.any() and not hit.all():
            used, faces = np.unique(faces[~hit], return_inverse=True)
            vertices, faces = vertices[used], faces.reshape(-1, 3)
            number = f"{strange.sum()}, with {hit.sum()} faces"
            notes.append(f"removed vertices that are not finite: {number}")
    surface, more = clean.checked(vertices, faces)
    return surface, notes + more


def _is_wrong(surface: TriMesh) -> bool:
    try:
        check_surface(surface)
    except InputError:
        return True
    return len(self_intersections(surface)) > 0


def _anew(surface: TriMesh, cell: float) -> clean.Step:
    """Rebuild the surface on a grid of cells, after each component was oriented outwards."""
    built = remesh(steps.outward(surface), cell)
    changes = "thinner parts are lost, overlapping parts are united"
    faces = f"faces {len(surface.faces)} -> {len(built.faces)}"
    notes = [f"rebuilt on cells of {cell:.3g}: {changes}; {faces}"]
    for step in (steps.drop_debris, lambda s: steps.fill_voids(s, np.inf)):
        built, done = step(built)
        notes += done
    if topology.is_closed(surface.faces):
        handles = topology.genus(surface), topology.genus(built)
        notes += ["genus {} -> {}".format(*handles)] * (handles[0] != handles[1])
    return built, notes


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
    """Largest distance of `one` from `other`; with `skin`, only for faces with one solid side."""
    middles = one.vertices[one.faces].mean(axis=1)
    points = np.concatenate([one.vertices[np.unique(one.faces)], middles])
    if skin is not None:
        every = len(middles) // SAMPLES + 1
        points, normals = middles[::every], skin * topology.face_normals(one)[::every]
        above, below = (winding_numbers(one, points + s * normals) > 0.5 for s in (1, -1))
        points = points[above != below]
    points = points[:: len(points) // SAMPLES + 1]
    if not len(points):
        return 0.0
    return float(distance(tree(other.vertices[other.faces]), points).max())
