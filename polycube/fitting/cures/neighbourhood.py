"""Extract the neighbourhood of some hexes of a fitted mesh, optionally with a sheet."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from polycube.fitting.creases.constraints import Matching, with_tolerances
from polycube.fitting.creases.paths import Route, path_sides
from polycube.fitting.cures.fitted import Fitted, edge_keys
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import part, quad_edges
from polycube.hexmesh.generation.sheets import has_sheet, with_sheet
from polycube.surface import arc_length
from polycube.types import HexMesh

RINGS = 3  # rings of hexes around seeds or a sheet whose vertices move

Detours = dict[tuple[int, int], list[int]]  # new vertices of a path between two existing ones


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Part of a mesh that is fitted separately."""

    problem: FitProblem  # the part, with the sheet
    matching: Matching  # its vertices on curves and corners
    used: np.ndarray  # (N,) vertices of the whole mesh; those of the sheet follow
    elements: np.ndarray  # (E,) hexes of the whole mesh
    moves: np.ndarray  # (N',) whether a vertex moves
    inside: np.ndarray | None  # (E,) hexes surrounded by the sheet; None without a sheet
    detours: Detours  # new parts of the paths that the sheet crosses, in vertex numbers of the part

    @property
    def moving(self) -> np.ndarray:
        """(M,) vertices of the whole mesh that move."""
        return self.used[self.moves[: len(self.used)]]


def neighbourhood(
    fit: Fitted, seeds: np.ndarray, inside: np.ndarray | None = None, rings: int = RINGS
) -> Neighbourhood | None:
    """Extract a neighbourhood.

    Returns the neighbourhood, or None if the sheet would be pinched or break a path.

    fit : the mesh
    seeds : (S,) hexes around which vertices move, without a sheet
    inside : (H,) hexes to surround by a sheet
    rings : rings of hexes whose vertices move
    """
    moving = moving_vertices(fit, seeds, inside, rings)
    elements = fit.links.at(moving)
    piece, used = part(fit.mesh, elements, np.stack(fit.links.sides, axis=1))
    moves = np.isin(used, moving)
    own, twin, whole = None, np.full(len(used), -1), piece
    if inside is not None:
        own = inside[elements]
        if not has_sheet(piece, own):
            return None
        piece = with_sheet(whole, own)
        sheet = piece.hexes[len(whole.hexes) :]
        twin[sheet[:, 4:]] = sheet[:, :4]  # the new vertex at each old one
        moves = np.append(moves, np.ones(len(piece.vertices) - len(used), bool))
    problem = FitProblem(piece, fit.target, samples=1)
    problem.restrict_to_faces(fit.cad_face[piece.patch])
    found = _routes(fit, whole, piece, used, twin)
    if found is None:
        return None
    routes, detours = found
    is_here = np.isin(fit.corners, used)
    corner = np.searchsorted(used, fit.corners[is_here])
    matching = Matching(tuple(routes), corner, fit.corner_goals[is_here])
    matching = with_tolerances(matching, len(piece.vertices))
    return Neighbourhood(problem, matching, used, elements, moves, own, detours)


def moving_vertices(
    fit: Fitted, seeds: np.ndarray, inside: np.ndarray | None, rings: int
) -> np.ndarray:
    """Vertices that move, ascending: those of some rings around the seeds or the sheet."""
    start = fit.links.vertices(seeds if inside is None else inside)
    if inside is not None:
        start &= fit.links.vertices(~inside)
    return fit.links.around(np.flatnonzero(start), rings)


def _routes(
    fit: Fitted, whole: HexMesh, piece: HexMesh, used: np.ndarray, twin: np.ndarray
) -> tuple[list[Route], Detours] | None:
    """Paths of the part, and their detours; None if the sheet breaks a path.

    whole : the part before the sheet
    """
    n = len(piece.vertices)
    known, edges = (
        edge_keys(quad_edges(mesh.quads, is_closed=False)[0], n) for mesh in (whole, piece)
    )
    place = np.full(len(fit.gap), -1)
    place[used] = np.arange(len(used))
    routes: list[Route] = []
    detours: Detours = {}
    for number, path in fit.paths.items():
        crease = fit.target.followed.creases[number]
        sides = path_sides(place[path], crease.is_loop)
        for run, start, end in _runs(crease.is_loop, np.isin(edge_keys(sides, n), known)):
            vertices = place[path[run]]
            own = crease
            if len(run) < len(path) or start != 0:
                x = fit.mesh.vertices[path]
                arc = arc_length.spread(crease.points, crease.arc, crease.is_loop, x)
                high = arc[end % len(path)] + crease.length * (end // len(path))
                own = crease.piece(arc[start], high)
            sides = path_sides(vertices, own.is_loop)
            for a, b in sides[~np.isin(edge_keys(sides, n), edges)].tolist():
                between = _detour(a, b, twin, edges, n)
                if between is None:
                    return None
                detours[a, b] = between
            routes.append(Route(own, with_detours(vertices, own.is_loop, detours)))
    return routes, detours


def _runs(is_loop: bool, is_here: np.ndarray) -> Iterator[tuple[np.ndarray, int, int]]:
    """Runs of the edges (N,) of a path in the part, as their vertices.

    Yields their numbers and the first and last index; in a loop, the last may exceed its length.
    """
    n = len(is_here) + (not is_loop)
    if is_loop and is_here.all():
        yield np.arange(n), 0, n - 1
        return
    shift = int(np.flatnonzero(~is_here)[0]) if is_loop else 0
    marked = np.concatenate([[False], np.roll(is_here, -shift), [False]])
    for start, high in np.flatnonzero(marked[1:] != marked[:-1]).reshape(-1, 2) + shift:
        if start >= n:
            start, high = start - n, high - n
        yield np.arange(start, high + 1) % n, int(start), int(high)


def _detour(a: int, b: int, twin: np.ndarray, edges: np.ndarray, n: int) -> list[int] | None:
    """The new vertices between a and b."""
    known = [int(twin[v]) if v < len(twin) else -1 for v in (a, b)]
    for between in ([known[0]], [known[1]], known):
        path = np.array([a, *between, b])
        if min(between) >= 0 and np.isin(edge_keys(path_sides(path, False), n), edges).all():
            return between
    return None


def with_detours(path: np.ndarray, is_loop: bool, detours: Detours) -> np.ndarray:
    """A path with the new vertices between its old ones."""
    if not detours:
        return path
    pieces = [[a, *detours.get((a, b), [])] for a, b in path_sides(path, is_loop).tolist()]
    last = [] if is_loop else [path[-1]]
    return np.array([*(v for each in pieces for v in each), *last], np.int64)
