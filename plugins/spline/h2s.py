"""The hex-to-spline construction of TH-spline3D."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from polycube.geometry.hexes import extraordinary_edges
from polycube.registry import register
from polycube.spline.bezier import min_detj, scaled_detj
from polycube.spline.extraction import volumetric_spline
from polycube.spline.features import (
    creases,
    folds,
    kinks,
    single_hex_edges,
    union,
    without_dead_ends,
)
from polycube.spline.refinement import refined_spline
from polycube.spline.selection import Refinement
from polycube.spline.subdivision import ControlMesh
from polycube.types import HexMesh, Spline, TriMesh

logger = logging.getLogger(__name__)


FLOOR = 0.1  # scaled det J below which a crease may not push an element


@register("spline", "h2s")
@dataclass(frozen=True)
class H2S:
    """Tricubic spline with the mesh's vertices as control points.

    C2 across regular faces, C0 round extraordinary edges.  It approximates the vertices: smooth
    boundary lies inside the mesh's.  det J is 0 along a smooth boundary edge with a single hex and
    where a sharp curve follows two edges of one face, so `single_hex_edges` makes the first sharp
    and the second corners.  `sharp: auto` keeps creases too, but for those that end in the smooth
    surface, whose free end would stick out, and those that would spoil det J, mostly concave ones.
    """

    sharp: str = "auto"  # auto: edges, and corners of their curves, turning by more than `angle`
    angle: float = 45.0  # degrees
    single_hex_edges: bool = True
    refine: Mapping | Refinement = field(default_factory=Refinement)

    def __post_init__(self) -> None:
        if self.sharp not in ("auto", "none"):
            raise ValueError(f"sharp must be auto or none; got {self.sharp!r}")
        if not 0 < self.angle < 180:
            raise ValueError(f"angle must lie in (0, 180) degrees; got {self.angle}")
        object.__setattr__(self, "refine", Refinement.of(self.refine))

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        sharp, corners = self._sharpened(hexes)
        singular = len(extraordinary_edges(hexes)[0])
        space = ControlMesh(hexes, sharp, corners)
        spline = refined_spline(space, self.refine, surface, singular)
        jacobian = min_detj(spline)
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
        if jacobian.min_detj <= 0:
            logger.warning("the spline is not valid: det J is not positive everywhere")
        return spline

    def _sharpened(self, hexes: HexMesh) -> tuple[np.ndarray, np.ndarray]:
        """Sharp edges (S, 2) and corners (P,): as many creases and kinks as leave det J alone."""
        forced = single_hex_edges(hexes) if self.single_hex_edges else np.zeros((0, 2), np.int64)
        corners = folds(hexes, forced) if self.single_hex_edges else np.zeros(0, np.int64)
        if self.sharp == "none":
            return forced, corners
        plain = forced, corners
        floor = np.minimum(scaled_detj(volumetric_spline(hexes, *plain)), FLOOR) - 1e-9
        found, blunt = creases(hexes, np.radians(self.angle)), np.zeros(0, np.int64)
        while True:
            kept = found[~np.isin(found, blunt).any(axis=1)]
            sharp = union(forced, without_dead_ends(union(forced, kept)))
            tips = np.setdiff1d(kinks(hexes, sharp, np.radians(self.angle)), blunt)
            corners = folds(hexes, sharp) if self.single_hex_edges else np.zeros(0, np.int64)
            corners = union(corners, tips)
            spline = volumetric_spline(hexes, sharp, corners)
            spoiled = hexes.hexes[scaled_detj(spline) < floor]
            if len(spoiled) == 0:
                return sharp, corners
            if np.isin(spoiled, blunt).all():
                return plain
            blunt = union(blunt, spoiled.ravel())
