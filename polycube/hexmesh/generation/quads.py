"""Quads of plane regions whose borders are given, by Gmsh in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycube.errors import MissingPackage

INSTALL = "pip install 'polycube[cad]'"
SECONDS = 120  # that it may take
NAMES = "vertices", "quads", "region"  # of arrays

Loop = Sequence[int]  # points round a region, the first not again


class NoQuadsError(Exception):
    """Says in one clause why there are no quads."""


@dataclass(frozen=True, eq=False)
class Plane:
    """Regions of the plane that are to be filled.

    Parameters
    ----------
    points : (P, 2) on the borders
    regions : loops of each, its outer one first
    corners : of each region its four corners, where it is to become a grid, or none
    size : of the edges of faces before they are divided, inside the regions at most
    """

    points: np.ndarray
    regions: Sequence[Sequence[Loop]]
    corners: Sequence[Loop]
    size: float


def quads(planes: Sequence[Plane]) -> list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """Fill regions with quads that meet in whole edges; each border edge becomes two of theirs.

    Triangles are made by frontal Delaunay for quads (Remacle et al. 2013) and joined in pairs, and
    all faces then divided at the middles of their edges.  The methods join them greedily, and by
    Blossom-Quad (Remacle et al. 2012).

    Returns
    -------
    of each plane and each method that succeeds vertices (V, 2), the points and the middles of
    border edges among them; quads (Q, 4), counter-clockwise where they are not folded; and the
    region of each (Q,)

    Raises
    ------
    MissingPackage
        Where Gmsh does not load.
    NoQuadsError
        Where it ends without any quads.
    """
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "quads.npz"
        request = {"output": str(output), "planes": [_plain(plane) for plane in planes]}
        try:
            done = subprocess.run(
                [sys.executable, "-m", "polycube.hexmesh.generation.quad_worker"],
                input=json.dumps(request),
                capture_output=True,
                text=True,
                errors="replace",
                timeout=SECONDS,
            )
        except subprocess.TimeoutExpired:
            raise NoQuadsError(f"Gmsh did not finish in {SECONDS} s") from None
        if not output.is_file():
            if "import gmsh" in done.stderr:
                raise MissingPackage("quads are made by gmsh, which does not load", remedy=INSTALL)
            last = (done.stderr.strip().splitlines() or ["it ended without a message"])[-1]
            raise NoQuadsError(f"Gmsh made no quads: {last}")
        found: list[list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = [[] for _ in planes]
        with np.load(output) as arrays:
            for number, plane in enumerate(arrays["plane"].tolist()):
                places, faces, region = (arrays[f"{name}{number}"] for name in NAMES)
                faces = _counter_clockwise(places, faces, region)
                found[plane].append((places, faces, region))
    if not any(found):
        raise NoQuadsError("Gmsh made no quads")
    return found


def _plain(plane: Plane) -> dict[str, object]:
    return {
        "points": plane.points.tolist(),
        "regions": [[list(loop) for loop in region] for region in plane.regions],
        "corners": [list(each) for each in plane.corners],
        "size": plane.size,
    }


def _counter_clockwise(vertices: np.ndarray, faces: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Quads turned round in regions whose area would be negative."""
    one, two = np.moveaxis(vertices[faces[:, [2, 3]]] - vertices[faces[:, [0, 1]]], 1, 0)
    area = np.bincount(region, one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    return np.where((area < 0)[region, None], faces[:, ::-1], faces)
