"""What the spline plugins share: what they keep sharp and where they are refined."""

import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polycube.errors import InputError
from polycube.geometry.hexes import extraordinary_edges, quad_edges
from polycube.spline.bezier import min_detj, scaled_detj
from polycube.spline.deviation import deviation
from polycube.spline.extraction import volumetric_spline
from polycube.spline.features import (
    creases,
    edges_between,
    folds,
    is_among,
    kinks,
    single_hex_edges,
    union,
    without_dead_ends,
)
from polycube.spline.fit import Fit
from polycube.spline.hierarchy import Space
from polycube.spline.refinement import refined_spline
from polycube.spline.selection import Refinement
from polycube.types import HexMesh, Spline, TriMesh

logger = logging.getLogger(__name__)

NONE = np.zeros((0, 2), np.int64)
FLOOR = 0.1  # scaled det J below which a crease may not push an element


@dataclass(frozen=True)
class Volumetric(ABC):
    """A spline on the hexes, its solid that of the h2s construction.

    There det J is 0 along a smooth boundary edge with a single hex and where a sharp curve follows
    two edges of one face, so `single_hex_edges` makes the first sharp and the second corners.
    `sharp: auto` keeps creases too, but for those that end in the smooth surface, whose free end
    would stick out, and those that would spoil det J, mostly concave ones.  Edges that are given
    are kept as they are.
    """

    sharp: str | list[list[int]] = "auto"  # or none, edges as pairs of vertices, a file of these
    angle: float = 45.0  # degrees, of edges and of corners of their curves
    single_hex_edges: bool = True
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
        object.__setattr__(self, "refine", Refinement.of(self.refine))
        object.__setattr__(self, "fit", Fit.of(self.fit))

    @abstractmethod
    def space(self, hexes: HexMesh, sharp: np.ndarray, corners: np.ndarray) -> Space:
        """The functions on the hexes and their coefficients; sharp (S, 2), corners (P,)."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        sharp, corners = self.sharpened(hexes)
        singular = len(extraordinary_edges(hexes)[0])
        space = self.space(hexes, sharp, corners)
        spline = self.fit(refined_spline(space, self.refine, surface, singular), surface)
        jacobian, apart = min_detj(spline), deviation(spline, surface)
        logger.info(
            "%d functions, %d elements, %d sharp and %d extraordinary edges, volume %.6g, "
            "det J %.3g at least (element %d at %.4g %.4g %.4g), scaled %.3g",
            len(spline.control),
            len(spline.nodes),
            len(sharp),
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

    def sharpened(self, hexes: HexMesh) -> tuple[np.ndarray, np.ndarray]:
        """Sharp edges (S, 2) and corners (P,).

        Raises InputError for edges that are given and are not on the boundary.
        """
        forced = single_hex_edges(hexes) if self.single_hex_edges else NONE
        if self.sharp == "auto":
            return self._automatic(hexes, forced)
        if self.sharp == "none":
            return forced, self._folds(hexes, forced)
        sharp = union(forced, self._given(hexes))
        tips = kinks(hexes, sharp, np.radians(self.angle))
        return sharp, union(self._folds(hexes, sharp), tips)

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

    def _folds(self, hexes: HexMesh, sharp: np.ndarray) -> np.ndarray:
        return folds(hexes, sharp) if self.single_hex_edges else np.zeros(0, np.int64)

    def _automatic(self, hexes: HexMesh, forced: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As many creases and kinks as leave det J alone."""
        plain = forced, self._folds(hexes, forced)
        floor = np.minimum(scaled_detj(volumetric_spline(hexes, *plain)), FLOOR) - 1e-9
        found, blunt = creases(hexes, np.radians(self.angle)), np.zeros(0, np.int64)
        while True:
            kept = found[~np.isin(found, blunt).any(axis=1)]
            sharp = union(forced, without_dead_ends(union(forced, kept)))
            tips = np.setdiff1d(kinks(hexes, sharp, np.radians(self.angle)), blunt)
            corners = union(self._folds(hexes, sharp), tips)
            spline = volumetric_spline(hexes, sharp, corners)
            spoiled = hexes.hexes[scaled_detj(spline) < floor]
            if len(spoiled) == 0:
                return sharp, corners
            if np.isin(spoiled, blunt).all():
                return plain
            blunt = union(blunt, spoiled.ravel())


def _numbers(path: str) -> np.ndarray:
    """(L, K) vertex numbers of the lines of a file."""
    try:
        return np.loadtxt(path, dtype=np.int64, ndmin=2)
    except ValueError as error:
        raise InputError(f"{path} must hold vertex numbers, as many a line: {error}") from error
