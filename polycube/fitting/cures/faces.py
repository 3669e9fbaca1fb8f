"""CAD faces with flat corners, and the hexes under them.

At a flat corner, two edges of a quad are nearly collinear. A sheet of hexes under the whole face
gives every vertex of its border two quads on the face.
"""

from collections.abc import Iterator

import numpy as np

from polycube.fitting.cures.fitted import Fitted, edge_keys
from polycube.fitting.flat_corners import FLAT
from polycube.hexmesh.connectivity import quad_edges
from polycube.surface.measures import connected


class Faces:
    """The quads of a fitted mesh, in parts enclosed by the paths of the curves."""

    def __init__(self, fit: Fitted) -> None:
        mesh, self.owner = fit.mesh, fit.links.sides[0]
        self.quads, self.hexes = mesh.quads, mesh.hexes
        sides, pair = quad_edges(mesh.quads)
        self._on = np.sort(fit.on_path)
        joined = ~np.isin(edge_keys(sides, len(fit.gap)), self._on)
        self.part = connected(pair[joined, 0], pair[joined, 1], len(mesh.quads))
        self.flat, self.sharp = self._corners(fit)

    def _corners(self, fit: Fitted) -> tuple[np.ndarray, np.ndarray]:
        """Quads (Q,) with flat corners between edges on paths, and quads (Q,) with other ones."""
        x, quads = fit.mesh.vertices, self.quads
        direction = x[np.roll(quads, -1, axis=1)] - x[quads]
        direction /= np.linalg.norm(direction, axis=2, keepdims=True) + 1e-30
        is_flat = np.einsum("qkd,qkd->qk", direction, -np.roll(direction, 1, axis=1)) < np.cos(FLAT)
        ends = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
        on = np.isin(edge_keys(ends, len(x)), self._on).reshape(-1, 4)
        between = on & np.roll(on, 1, axis=1)
        flat = (between & is_flat).any(axis=1)
        ends = between & np.isin(quads, fit.corners) & ~is_flat
        return flat, ends.any(axis=1) & ~flat

    def under(self, quads: np.ndarray) -> np.ndarray:
        """(H,) the hexes under some quads (Q,)."""
        found = np.zeros(len(self.hexes), bool)
        found[self.owner[quads]] = True
        return found

    def with_flat_corners(self, cad_face: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Numbers of CAD faces (Q,) with flat corners, and hexes (H,) to surround by a sheet."""
        for number in np.unique(self.part[self.flat]):
            own = self.part == number
            yield int(cad_face[own][0]), self.under(own & ~self.sharp)
