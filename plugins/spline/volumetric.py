"""What the spline plugins share: what they keep sharp and where they are refined."""

import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polycube.analysis.boundary_sets import check_place, place_of, quads_of
from polycube.errors import InputError
from polycube.hexmesh.connectivity import extraordinary_edges, quad_edges
from polycube.spline.bezier import min_detj
from polycube.spline.deviation import deviation
from polycube.spline.fit import Fit
from polycube.spline.spaces.hierarchy import Space
from polycube.spline.spaces.refinement import refined_spline
from polycube.spline.spaces.selection import Refinement
from polycube.spline.spaces.sharp_features import (
    border,
    edges_between,
    is_among,
    kinks,
    single_hex_edges,
    union,
)
from polycube.spline.spaces.sharpness import GOOD, INVALID, NO_EDGES, POOR, Creases, Sharp, Trial
from polycube.types import HexMesh, Spline, TriMesh

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Volumetric(ABC):
    """A spline on the hexes, its solid that of the h2s construction.

    There det J is 0 along a smooth boundary edge with a single hex and where a sharp curve follows
    two edges of one face, so `single_hex_edges` makes the first sharp and the second corners.
    `sharp: auto` keeps creases too, but for those that end in the smooth surface, whose free end
    would stick out, and those that would spoil det J, mostly concave ones.  These are tried as
    well where the spline is fitted, which may mend det J, and with the hexes round them straight
    where it does not: the best of these splines is kept.  Edges that are given are all kept.
    The border of what an analysis holds is sharp where possible: inside a smooth sheet, a support
    would otherwise hold the slope and curvature of the functions there too.
    """

    sharp: str | list[list[int]] = "auto"  # or none, edges as pairs of vertices, a file of these
    angle: float = 45.0  # degrees, of edges and of corners of their curves
    single_hex_edges: bool = True
    held: Sequence[object] = ()  # places, as the analysis has them in `fixed`
    refine: Mapping | Refinement = field(default_factory=Refinement)
    fit: Mapping | Fit = field(default_factory=Fit)

    def __post_init__(self) -> None:
        if not 0 < self.angle < 180:
            raise ValueError(f"angle must lie in (0, 180) degrees; got {self.angle}")
        if not isinstance(self.sharp, str):
            if not all(np.shape(edge) == (2,) for edge in self.sharp):
                raise ValueError(f"sharp edges must be pairs of vertices; got {self.sharp}")
        elif self.sharp not in ("auto", "none") and not Path(self.sharp).is_file():
            raise ValueError(
                f"sharp must be auto, none, a list of edges or a file of such; got {self.sharp!r}"
            )
        for item in self.held:
            check_place(place_of(item))
        object.__setattr__(self, "refine", Refinement.of(self.refine))
        object.__setattr__(self, "fit", Fit.of(self.fit))

    @abstractmethod
    def space(self, hexes: HexMesh, sharp: Sharp) -> Space:
        """The functions on the hexes and their coefficients."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        best = self._better(surface, hexes)
        spline, sharp = best.spline, best.sharp
        jacobian, apart = min_detj(spline), deviation(spline, surface)
        logger.info(
            "%d functions, %d elements, %d sharp edges, %d straight hexes, %d extraordinary edges, "
            "volume %.6g, det J %.3g at least (element %d at %.4g %.4g %.4g), scaled %.3g",
            len(spline.control),
            len(spline.nodes),
            len(sharp.edges),
            len(sharp.straight),
            spline.extraordinary_edges,
            jacobian.volume,
            jacobian.min_detj,
            jacobian.element,
            *jacobian.position,
            jacobian.min_scaled_detj,
        )
        logger.info(
            "spline within %.3f %% of the diagonal of the surface for 99 %% of its boundary, the "
            "surface within %.3f %% of the spline, volume %+.2f %%",
            100 * apart.to_surface.p99,
            100 * apart.to_spline.p99,
            100 * apart.volume,
        )
        if jacobian.min_detj <= 0:
            logger.warning("the spline is not valid: det J is not positive everywhere")
        return spline

    def _better(self, surface: TriMesh, hexes: HexMesh) -> Trial:
        """The spline that costs least of those with all creases, the harmless ones, and all with
        straight hexes; each is made only where those before are not good.
        """
        harmless, creases = self.sharpened(hexes), self._creases(hexes)

        def trial(name: str, sharp: Sharp) -> Trial:
            spline = self._solid(surface, hexes, sharp)
            return Trial.of(name, spline, sharp, surface, self.fit.floor, creases.lost(sharp))

        if self.fit.iterations == 0:
            return trial("harmless", harmless)
        every = creases.all_but(NO_EDGES) if self.sharp == "auto" else harmless
        trials = [trial("all", every)]
        if trials[0].cost > GOOD and not all(map(np.array_equal, every, harmless)):
            trials.append(trial("harmless", harmless))
        if min(t.cost for t in trials) > POOR or trials[0].cost >= INVALID:
            eased = creases.straightened(every)
            if len(eased.straight):
                trials.append(trial("all", eased))
        best = min(trials, key=lambda t: t.cost)
        if self.sharp == "auto" or len(trials) > 1:
            words = "; ".join(t.words(surface) for t in trials)
            logger.info("%s creases kept, %s", best.name, words)
        return best

    def _solid(self, surface: TriMesh, hexes: HexMesh, sharp: Sharp) -> Spline:
        singular = len(extraordinary_edges(hexes)[0])
        space = self.space(hexes, sharp)
        return self.fit(refined_spline(space, self.refine, surface, singular), surface)

    def sharpened(self, hexes: HexMesh) -> Sharp:
        """Sharp edges and corners, of creases the harmless ones.

        Raises InputError for edges that are given and are not on the boundary.
        """
        found = self._creases(hexes)
        if self.sharp == "auto":
            return found.harmless()
        sharp = union(found.forced, found.borders)
        if self.sharp == "none":
            return Sharp(sharp, found.folds(sharp))
        sharp = union(sharp, self._given(hexes))
        return Sharp(sharp, union(found.folds(sharp), kinks(hexes, sharp, found.angle)))

    def _creases(self, hexes: HexMesh) -> Creases:
        forced = single_hex_edges(hexes) if self.single_hex_edges else NO_EDGES
        held = (border(hexes, quads_of(hexes, place_of(item))) for item in self.held)
        borders = union(NO_EDGES, *held)
        return Creases(hexes, forced, np.radians(self.angle), self.single_hex_edges, borders)

    def _given(self, hexes: HexMesh) -> np.ndarray:
        """(S, 2) the edges of the option or of its file, ends ascending, each once.

        A file holds an edge a line; or a vertex a line, alone or with a 0 before it as for
        TH-spline3D: then all boundary edges between them are sharp.
        """
        if not isinstance(self.sharp, str):
            table = np.reshape(np.asarray(self.sharp, np.int64), (-1, 2))
        else:
            table = _numbers(self.sharp)
            if table.shape[1] == 1 or (table[:, 0] == 0).all():
                return edges_between(hexes, table[:, -1])
        given = np.unique(np.sort(table[:, :2], axis=1), axis=0)
        stray = ~is_among(given, quad_edges(hexes.quads)[0])
        if stray.any():
            raise InputError(
                f"spline: sharp edge {given[stray.argmax()].tolist()} is no edge of the boundary"
            )
        return given


def _numbers(path: str) -> np.ndarray:
    """(L, K) vertex numbers of the lines of a file."""
    try:
        return np.loadtxt(path, dtype=np.int64, ndmin=2)
    except ValueError as error:
        raise InputError(f"{path} must hold vertex numbers, as many a line: {error}") from error
