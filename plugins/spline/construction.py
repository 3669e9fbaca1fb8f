"""Make a spline on the hexes: choose the sharp features and the best of several trials."""

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from polycube.analysis.boundary_sets import is_edge, mesh_edges_of, quads_of
from polycube.analysis.cyclic import Sector, cut_faces, matched
from polycube.analysis.supports import split
from polycube.errors import InputError
from polycube.hexmesh.cad_faces import unique_cad_faces
from polycube.hexmesh.connectivity import extraordinary_edges, quad_edges
from polycube.hexmesh.named_sets import quads_of_spline
from polycube.spline.bezier import min_detj
from polycube.spline.boundary import distances, edge_strips
from polycube.spline.spaces.continuous import ContinuousSpace
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.hierarchy import Space
from polycube.spline.spaces.optimal import smallest_space
from polycube.spline.spaces.refinement import refined_spline
from polycube.spline.spaces.sharp_features import (
    border,
    cad_corners,
    cad_edges,
    edges_between,
    is_among,
    single_hex_edges,
    union,
)
from polycube.spline.spaces.sharpness import GOOD, INVALID, NO_EDGES, POOR, Creases, Sharp, Trial
from polycube.spline.spaces.subdivision import ControlMesh
from polycube.spline.surface_fit import fit_to_surface
from polycube.types import HexMesh, Spline, TriMesh

from .options import SplineOptions

logger = logging.getLogger(__name__)

Start = Callable[[], np.ndarray]  # (B, 3) Bezier points of h2s, fitted to the surface
# the functions on the hexes and their coefficients
SPACES: dict[str, Callable[[HexMesh, Sharp, Start], Space]] = {
    "c0": lambda hexes, sharp, start: ContinuousSpace(hexes, start()),
    "h2s": lambda hexes, sharp, start: ControlMesh(hexes, *sharp),
    "optimal": lambda hexes, sharp, start: smallest_space(hexes, start(), *sharp),
}
REENTRANT = 200  # angle inside the part in degrees above which the stress at an edge is unbounded


class Construction:
    """Splines with the same options on the hexes of a part."""

    def __init__(self, options: SplineOptions, surface: TriMesh, hexes: HexMesh) -> None:
        if options.sector is not None:
            hexes = replace(hexes, vertices=matched(hexes.vertices, hexes.quads, options.sector))
        self.options, self.surface, self.hexes = options, surface, hexes
        self.creases = creases_of(options, hexes, surface)
        self.on = unique_cad_faces(hexes, surface)
        self.singular = len(extraordinary_edges(hexes)[0])

    def best_trial(self, space: str, known: Trial | None = None) -> Trial:
        """The spline with the smallest cost; `known` is the best one of h2s.

        Tried are splines with all creases, with all creases and straight hexes if the former costs
        more than `POOR`, and with the harmless creases; each is only made if the earlier ones are
        not good.
        """
        options, creases, trial = self.options, self.creases, partial(self._trial, space, known)
        harmless = sharp_features(options, self.hexes, creases)
        if options.fit.iterations == 0:
            return trial("harmless", harmless)
        all_creases = creases.all_but(NO_EDGES) if options.sharp == "auto" else harmless
        trials = [trial("all", all_creases)]
        if trials[0].cost > POOR:
            straightened = creases.straightened(all_creases)
            if len(straightened.straight):
                trials.append(trial("all", straightened))
        enough = GOOD if len(trials) == 1 else POOR
        if min(t.cost for t in trials) > enough or trials[0].cost >= INVALID:
            if not all(map(np.array_equal, all_creases, harmless)):
                trials.insert(1, trial("harmless", harmless))
        best = min(trials, key=lambda t: t.cost)
        if options.sharp == "auto" or len(trials) > 1:
            logger.info("creases: %s; %s", best.name, "; ".join(t.summary() for t in trials))
        return best

    def finished(self, best: Trial) -> Spline:
        """The spline of a trial; logs how many edges are sharp and the smallest det J."""
        spline, sharp, surface = best.spline, best.sharp, self.surface
        if self.options.sector is not None:
            control = spline.control.copy()
            first, second = Sector.of(spline, self.options.sector).functions.T
            control[second] = self.options.sector.turned(control[first])
            spline = replace(spline, control=control)
        jacobian = min_detj(spline)
        sizes = [len(each) for each in (spline.control, spline.nodes, sharp.edges, sharp.straight)]
        sizes.append(spline.extraordinary_edges)
        numbers = jacobian.volume, jacobian.min_detj, jacobian.element, *jacobian.position
        form = "%d functions, %d elements, %d sharp edges, %d straight hexes"
        form += ", %d extraordinary edges, volume %.6g"
        form += ", smallest det J %.3g (element %d at %.4g %.4g %.4g), scaled %.3g"
        logger.info(form, *sizes, *numbers, jacobian.min_scaled_detj)
        if jacobian.min_detj <= 0:
            logger.warning("the spline is not valid: det J is not positive everywhere")
        offset, tilt = distances(spline, surface)
        edges = _inner_edges(spline, self.hexes, surface)
        return replace(spline, inner_edges=edges, offset=offset, tilt=tilt)

    def size(self) -> int:
        """About the number of functions of the space optimal with these sharp features."""
        sharp = sharp_features(self.options, self.hexes, self.creases)
        plain = volumetric_spline(self.hexes, *sharp)
        made = smallest_space(self.hexes, plain.extraction @ plain.control, *sharp)
        return made.size * 8**self.options.refine.levels

    def _trial(self, space: str, known: Trial | None, name: str, sharp: Sharp) -> Trial:
        own = SPACES[space](self.hexes, sharp, partial(self._start, sharp, known))
        spline = self._fitted(refined_spline(own, self.options.refine, self.surface, self.singular))
        floor, lost = self.options.fit.floor, self.creases.lost(sharp)
        return Trial.of(name, spline, sharp, self.surface, floor, lost)

    def _start(self, sharp: Sharp, known: Trial | None) -> np.ndarray:
        """(B, 3) Bezier points of h2s, fitted to the surface."""
        is_refined = known is not None and len(known.spline.nodes) > len(self.hexes.hexes)
        if known is None or is_refined or not all(map(np.array_equal, known.sharp, sharp)):
            plain = self._fitted(volumetric_spline(self.hexes, *sharp))
        else:
            plain = known.spline
        return np.asarray(plain.extraction @ plain.control)

    def _fitted(self, spline: Spline) -> Spline:
        on = self.on[quads_of_spline(spline, self.hexes)]
        return fit_to_surface(self.options.fit, spline, self.surface, on)


def _inner_edges(spline: Spline, hexes: HexMesh, surface: TriMesh) -> np.ndarray:
    """(R, 2) pairs of sides of the spline on both sides of re-entrant edges of the CAD model."""
    if not len(surface.region):
        return np.zeros((0, 2), np.int64)
    _, quads, inside = cad_edges(hexes, surface)
    wanted = np.sort(quads[inside > np.radians(REENTRANT)], axis=1)
    _, first, second = edge_strips(spline)
    pairs = np.stack([first, second], axis=1) // 4
    return pairs[is_among(np.sort(quads_of_spline(spline, hexes)[pairs], axis=1), wanted)]


def sharp_features(options: SplineOptions, hexes: HexMesh, found: Creases) -> Sharp:
    """The sharp features of the options, among the given creases; of these, the harmless ones.

    Raises InputError if given edges are not on the boundary.
    """
    if options.sharp == "auto":
        return found.harmless()
    sharp = union(found.forced, found.borders)
    if options.sharp == "none":
        return Sharp(sharp, found.folds(sharp))
    sharp = union(sharp, _listed_edges(options, hexes))
    return Sharp(sharp, union(found.folds(sharp), found.kinks(sharp)))


def creases_of(options: SplineOptions, hexes: HexMesh, surface: TriMesh | None) -> Creases:
    """The creases of a surface of a CAD model, or, without one, those of the hexes by angle."""
    forced = single_hex_edges(hexes) if options.single_hex_edges else NO_EDGES
    if options.sector is not None:
        cut = cut_faces(hexes.vertices, hexes.quads, options.sector)
        forced = union(forced, *(border(hexes, quads) for quads in cut))
    supported = (
        mesh_edges_of(hexes, place)[0] if is_edge(place) else border(hexes, quads_of(hexes, place))
        for place, _ in map(split, options.held)
    )
    borders = union(NO_EDGES, *supported)
    if options.joined is not None:
        forced, borders = union(forced, options.joined[0]), union(borders, options.joined[1])
    angle, fold = np.radians(options.angle), options.single_hex_edges
    if surface is None or not len(surface.region):
        return Creases(hexes, forced, angle, fold, borders)
    edges, _, inside = cad_edges(hexes, surface)
    found = edges[abs(np.pi - inside) > np.radians(options.cad_angle)]
    return Creases(hexes, forced, angle, fold, borders, found, cad_corners(hexes, surface))


def _listed_edges(options: SplineOptions, hexes: HexMesh) -> np.ndarray:
    """(S, 2) the edges of the option or of its file, with ascending ends, without duplicates.

    A file has one edge per line; or one vertex per line, alone or after a 0 as in TH-spline3D: then
    all boundary edges between these vertices are sharp.
    """
    if not isinstance(options.sharp, str):
        table = np.reshape(np.asarray(options.sharp, np.int64), (-1, 2))
    else:
        try:
            table = np.loadtxt(options.sharp, dtype=np.int64, ndmin=2)
        except ValueError as error:
            what = f"{options.sharp} must have as many vertex numbers in each line: {error}"
            raise InputError(what) from error
        if table.shape[1] == 1 or (table[:, 0] == 0).all():
            return edges_between(hexes, table[:, -1])
    given = np.unique(np.sort(table[:, :2], axis=1), axis=0)
    stray = ~is_among(given, quad_edges(hexes.quads)[0])
    if stray.any():
        what = f"spline: sharp edge {given[stray.argmax()].tolist()} is not on the boundary"
        raise InputError(what)
    return given
