"""Quads of planar regions with given borders, by Gmsh in a separate process."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from polycube.errors import MissingPackage
from polycube.hexmesh.background.background import NoBackgroundError

INSTALL = "pip install 'polycube[cad]'"
SECONDS = 120  # time limit
NAMES = "vertices", "quads", "region"  # of arrays

Loop = Sequence[int]  # points around a region, without repeating the first


@dataclass(frozen=True, eq=False)
class Plane:
    """Regions of a plane to be filled with quads."""

    points: np.ndarray  # (P, 2) points on the borders
    regions: Sequence[Sequence[Loop]]  # loops of each region, the outer one first
    corners: Sequence[Loop]  # for each region the four corners of a structured grid, or none
    size: float  # largest edge length inside the regions, before the faces are divided


def quads(planes: Sequence[Plane]) -> list[tuple[np.ndarray, np.ndarray, np.ndarray] | None]:
    """Fill regions with quads that share whole edges; each border edge is divided in two.

    Triangles from the frontal Delaunay method for quads (Remacle et al. 2013) are combined in
    pairs, and all faces are then divided at the midpoints of their edges. Returns for each plane:
    vertices (V, 2), including the points and the midpoints of border edges; quads (Q, 4),
    counter-clockwise unless folded; region of each quad (Q,); None where Gmsh fails. Raises
    MissingPackage if Gmsh cannot be loaded. Raises NoBackgroundError if it fails for all planes.
    """
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray] | None] = [None] * len(planes)
    with tempfile.TemporaryDirectory() as folder:
        last = _run(Path(folder), planes)
        for path in Path(folder).glob("*.npz"):
            with np.load(path) as arrays:
                places, faces, region = (arrays[name] for name in NAMES)
            one, two = np.moveaxis(places[faces[:, [2, 3]]] - places[faces[:, [0, 1]]], 1, 0)
            area = np.bincount(region, one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
            faces = np.where((area < 0)[region, None], faces[:, ::-1], faces)
            found[int(path.stem)] = places, faces, region
    if not any(found):
        raise NoBackgroundError(f"Gmsh made no quads: {last}")
    return found


def _run(folder: Path, planes: Sequence[Plane]) -> str:
    """Let the worker write its files, and return its last message.

    If it ends at a plane, because Gmsh crashed or did not return, it goes on after it.
    """
    first, last = 0, "its meshes are empty"
    request = {"folder": str(folder), "planes": list(map(asdict, planes))}
    while True:
        try:
            done = subprocess.run(
                [sys.executable, "-m", "polycube.hexmesh.generation.quad_worker"],
                input=json.dumps(
                    {**request, "first": first}, default=lambda row: np.asarray(row).tolist()
                ),
                capture_output=True,
                text=True,
                errors="replace",
                timeout=SECONDS,
            )
        except subprocess.TimeoutExpired:
            return f"it did not finish in {SECONDS} s"
        if "import gmsh" in done.stderr:
            raise MissingPackage("quads are made by gmsh, which does not load", remedy=INSTALL)
        if not done.returncode:
            return last
        last = (done.stderr.strip().splitlines() or ["it ended without a message"])[-1]
        first += len(done.stdout.split()) + 1
