"""Volumetric splines on a hex mesh."""

import logging
from dataclasses import dataclass

import numpy as np

from polycube.registry import register
from polycube.spline.bezier import min_detj
from polycube.spline.extraction import volumetric_spline
from polycube.spline.features import (
    creases,
    folds,
    kinks,
    single_hex_edges,
    union,
    without_dead_ends,
)
from polycube.types import HexMesh, Spline

logger = logging.getLogger(__name__)


@register("spline", "h2s")
@dataclass(frozen=True)
class H2S:
    """Tricubic spline with the mesh's vertices as control points.

    C2 across regular faces, C0 round extraordinary edges.  It approximates the vertices: smooth
    boundary lies inside the mesh's.  det J is 0 along a smooth boundary edge with a single hex and
    where a sharp curve follows two edges of one face, so `single_hex_edges` makes the first sharp
    and the second corners.  Creases that end in the smooth surface are left smooth: their free
    end would stick out of it.
    """

    sharp: str = "auto"  # auto: edges, and corners of their curves, turning by more than `angle`
    angle: float = 45.0  # degrees
    single_hex_edges: bool = True

    def __post_init__(self) -> None:
        if self.sharp not in ("auto", "none"):
            raise ValueError(f"sharp must be auto or none; got {self.sharp!r}")
        if not 0 < self.angle < 180:
            raise ValueError(f"angle must lie in (0, 180) degrees; got {self.angle}")

    def __call__(self, hexes: HexMesh) -> Spline:
        """The spline; logs how many edges are sharp and the smallest det J."""
        sharp, corners = np.zeros((0, 2), np.int64), np.zeros(0, np.int64)
        if self.sharp == "auto":
            sharp = without_dead_ends(creases(hexes, np.radians(self.angle)))
        if self.single_hex_edges:
            sharp = union(sharp, single_hex_edges(hexes))
            corners = folds(hexes, sharp)
        if self.sharp == "auto":
            corners = union(corners, kinks(hexes, sharp, np.radians(self.angle)))
        spline = volumetric_spline(hexes, sharp, corners)
        jacobian = min_detj(spline)
        logger.info(
            "%d functions, %d elements, %d sharp and %d extraordinary edges, volume %.6g, "
            "scaled det J >= %.3g (element %d at %.4g %.4g %.4g)",
            len(spline.control),
            len(spline.nodes),
            len(sharp),
            spline.extraordinary_edges,
            jacobian.volume,
            jacobian.min_scaled_detj,
            jacobian.element,
            *jacobian.position,
        )
        return spline
