"""Surfaces of solids that touch, with common triangles: `python -m polycube.io.solids.touching`.

Open CASCADE divides the faces of touching solids until they have whole faces in common: an imprint
of their interfaces. The process reads a request as `solids.worker`, and writes as `cad_worker`.
"""

import json
import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from polycube.errors import InputError
from polycube.io.access.reading import reading
from polycube.io.cad_worker import opened, tessellated
from polycube.io.file_units import gmsh_lengths
from polycube.io.foreign.process import Late, read_separately
from polycube.io.tessellation.sewing import diagonal
from polycube.surface.measures import connected
from polycube.surface.repair.clean import clean
from polycube.types import TriMesh

EFFORT = 5  # time limit, relative to that of one solid


def touching(path: Path, segments: int) -> list[dict[int, TriMesh]]:
    """Surfaces of the solids of a CAD file that touch at faces, in its units.

    Returns surfaces by the number of the solid, from 1, for each group of touching solids. A common
    face of two solids is a CAD face of both, with the same triangles. Raises InputError if solids
    overlap, or Open CASCADE fails or needs too long.

    segments : triangle edges on a full turn of a round face
    """
    worker, options = "polycube.io.solids.touching", {"segments": segments}
    try:
        with reading(path):
            output, _ = read_separately(worker, path, options, EFFORT)
    except Late as late:
        raise InputError(f"common faces were not found in {late.seconds} s") from None
    if output is None:
        raise InputError("the solids overlap, or Open CASCADE cannot divide their faces")
    found = dict(np.load(BytesIO(output)))
    sides = found["sides"].astype(int)
    first, second = np.nonzero(sides @ sides.T)
    group = connected(first, second, len(sides))
    found["vertices"] /= gmsh_lengths(path)
    return [
        {k + 1: _surface(found, sides[k]) for k in np.flatnonzero(group == number).tolist()}
        for number in np.flatnonzero(np.bincount(group) > 1)
    ]


def main() -> None:
    """Write triangles with the number of their face, and which faces (N, F) each solid has."""
    request = json.load(sys.stdin)
    gmsh, _ = opened(request)
    model = gmsh.model
    _, pieces = model.occ.fragment(model.getEntities(3), [])
    model.occ.synchronize()
    if any(len(own) > 1 for own in pieces) or len(np.unique(pieces, axis=0)) < len(pieces):
        sys.exit("two solids have a piece in common")
    number = {tag: k for k, (_, tag) in enumerate(model.getEntities(2))}
    sides = np.zeros((len(pieces), len(number)), bool)
    for k, own in enumerate(pieces):
        sides[k, [number[tag] for _, tag in model.getBoundary(own, oriented=False)]] = True
    found = tessellated(gmsh, number, diagonal(gmsh), request["segments"])
    found["sides"] = sides
    with open(request["output"], "wb") as file:
        np.savez(file, allow_pickle=False, **found)
    gmsh.finalize()


def _surface(found: dict[str, np.ndarray], own: np.ndarray) -> TriMesh:
    """Surface of a solid with the given faces (S,), which are numbered from 1."""
    is_own = own[found["cad_face"]] > 0
    faces, number = found["faces"][is_own], np.cumsum(own)[found["cad_face"][is_own]]
    surface, _ = clean(found["vertices"], faces)
    known = cKDTree(found["vertices"][faces].mean(axis=1))  # cleaning may drop triangles
    region = number[known.query(surface.vertices[surface.faces].mean(axis=1))[1]]
    return replace(surface, region=region, region_names=own.sum() * ("",))


if __name__ == "__main__":
    main()
