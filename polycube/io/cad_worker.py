"""Tessellate a CAD file with gmsh: `python -m polycube.io.cad_worker`, a process of its own.

Open CASCADE writes to the standard output, and may crash; gmsh takes over signals and is GPL.
Reads a request as JSON on standard input; writes arrays to the .npz it names.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np

from polycube.io.foreign.process import limit

SEW = 1e-5  # of the diagonal: gaps of loose faces that are closed
COARSE = 1 / 20  # of the diagonal: largest triangle edge
FINE = 1 / 1000  # smallest


def main() -> None:
    """Solids of the file, and the triangles of the one asked for; lengths in millimetres."""
    request = json.load(sys.stdin)
    gmsh = opened(request)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", request["segments"])
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    found = {
        "volume": np.array([gmsh.model.occ.getMass(3, tag) for tag in solids]),
        "box": np.array([gmsh.model.getBoundingBox(3, tag) for tag in solids]).reshape(-1, 6),
    }
    number = request["solid"]
    if number is None and len(solids) == 1:
        number = 1
    if number is not None and 1 <= number <= len(solids):
        found |= _triangles(gmsh, solids, number - 1)
    with open(request["output"], "wb") as file:
        np.savez(file, allow_pickle=False, **found)
    gmsh.finalize()


def opened(request: Mapping[str, Any]) -> ModuleType:
    """gmsh with the solids of a file, in millimetres.

    request : the `path`, and the `seconds` and `gigabytes` that may be used
    """
    limit(request)
    import gmsh

    gmsh.initialize(interruptible=False)
    for name, value in {
        "General.Terminal": 0,
        "General.NumThreads": 1,
        "Mesh.Algorithm": 6,
        "Mesh.RandomSeed": 1,
        "Mesh.MeshSizeExtendFromBoundary": 0,
    }.items():
        gmsh.option.setNumber(name, value)
    if request["path"].lower().endswith((".step", ".stp")):  # others have no units or are in mm
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    gmsh.model.occ.importShapes(request["path"])
    gmsh.model.occ.synchronize()
    if not gmsh.model.getEntities(3) and gmsh.model.getEntities(2):  # IGES: loose faces
        gap = SEW * _diagonal(gmsh)
        gmsh.model.occ.healShapes(tolerance=gap, sewFaces=True, makeSolids=True)
        gmsh.model.occ.synchronize()
    return gmsh


def _diagonal(gmsh: ModuleType) -> float:
    low, high = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
    return float(np.linalg.norm(high - low))


def _triangles(gmsh: ModuleType, solids: list[int], chosen: int) -> dict[str, np.ndarray]:
    """Vertices (V, 3), faces (F, 3), the CAD face of each (F,), from 1.

    Of each CAD face: kind of surface, name, number of corners, and these, all in a row.
    """
    others = [(3, tag) for i, tag in enumerate(solids) if i != chosen]
    gmsh.model.occ.remove(others, recursive=True)
    gmsh.model.occ.synchronize()
    size = _diagonal(gmsh)
    gmsh.option.setNumber("Mesh.MeshSizeMax", COARSE * size)
    gmsh.option.setNumber("Mesh.MeshSizeMin", FINE * size)
    gmsh.model.mesh.generate(2)
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags] = np.arange(len(tags))
    sides = sorted(tag for _, tag in gmsh.model.getBoundary([(3, solids[chosen])], oriented=False))
    faces = [place[gmsh.model.mesh.getElementsByType(2, side)[1].reshape(-1, 3)] for side in sides]
    ends = [gmsh.model.getBoundary([(2, side)], oriented=False, recursive=True) for side in sides]
    corners = [gmsh.model.getValue(0, tag, []) for own in ends for _, tag in own]
    return {
        "vertices": points.reshape(-1, 3),
        "faces": np.concatenate(faces),
        "cad_face": np.repeat(np.arange(1, len(sides) + 1), [len(own) for own in faces]),
        "face_kind": np.array([gmsh.model.getType(2, side) for side in sides]),
        "face_name": np.array(_names(gmsh, sides)),
        "corners": np.reshape(corners, (-1, 3)),
        "n_corners": np.array([len(own) for own in ends]),
    }


def _names(gmsh: ModuleType, sides: list[int]) -> list[str]:
    """What gmsh calls each face; where it has no names but several colours, `colour_ff0000`."""
    names = [gmsh.model.getEntityName(2, side).rpartition("/")[2] for side in sides]
    colours = [gmsh.model.getColor(2, side) for side in sides]
    if any(names) or len(set(colours)) == 1:
        return names
    return ["colour_{:02x}{:02x}{:02x}".format(*c[:3]) if c[3] else "" for c in colours]


if __name__ == "__main__":
    main()
