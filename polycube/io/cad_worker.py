"""Tessellate a CAD file with gmsh in a separate process: `python -m polycube.io.cad_worker`.

Open CASCADE writes to the standard output and may crash; gmsh replaces signal handlers and is under
the GPL. The process reads a request as JSON from standard input and writes arrays to the .npz file
given there.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from polycube.io.file_units import IGES, gmsh_lengths, gmsh_unit
from polycube.io.foreign.process import limit
from polycube.io.step.faces import Named, named_faces
from polycube.io.step.text import STEP
from polycube.io.tessellation.sewing import bound_sizes, bounded_segments, diagonal, sew

REMOVING = "reading is done; features are removed"  # written to the standard error
TESSELLATING = "reading is done; triangles are made"  # the same
REFUSED = "refused: "  # the same, before a sentence about the request
OPEN = "the triangles are not closed"  # the same
WAYS = ("curved", "edges", "coarser")  # sizes from curvatures, from edges, from fewer segments
CURVED, EDGES, COARSER = WAYS
COARSE = 1 / 20  # of the diagonal: largest triangle edge
FINE = 1 / 1000  # smallest
NO_NAME = "Open CASCADE STEP translator"  # entry of Open CASCADE for a missing name


def main() -> None:
    """Write the solids of the file, and the triangles of the requested one, in `gmsh_unit`."""
    request = json.load(sys.stdin)
    gmsh, sewn = opened(request)
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    found = sewn | {
        "volume": np.array([gmsh.model.occ.getMass(3, tag) for tag in solids]),
        "box": np.array([gmsh.model.getBoundingBox(3, tag) for tag in solids]).reshape(-1, 6),
    }
    number = 1 if request["solid"] is None and len(solids) == 1 else request["solid"]
    if number is not None and 1 <= number <= len(solids):
        found |= _triangles(gmsh, solids, number - 1, request)
        sides = np.sort(found["faces"][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        if (np.unique(sides, axis=0, return_counts=True)[1] != 2).any():
            sys.stderr.write(f"{OPEN}\n")
    with open(request["output"], "wb") as file:
        np.savez(file, allow_pickle=False, **found)
    gmsh.finalize()


def opened(request: Mapping[str, Any]) -> tuple[ModuleType, dict[str, np.ndarray]]:
    """Gmsh with the solids of a file, in `gmsh_unit`, and the gap between loose faces, if any.

    request : the `path`, and the limits `seconds` and `gigabytes`
    """
    limit(request)
    import gmsh

    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("Mesh.Algorithm", 6)
    gmsh.option.setNumber("Mesh.RandomSeed", 1)
    path = Path(request["path"])
    unit = gmsh_unit(path)
    if path.suffix.lower() in IGES:  # Open CASCADE has a target unit only after it wrote a file
        gmsh.model.occ.addPoint(0, 0, 0)
        gmsh.model.occ.synchronize()
        gmsh.write(f"{request['output']}.igs")
        gmsh.clear()
    gmsh.option.setString("Geometry.OCCTargetUnit", "INCH" if unit == "in" else unit.upper())
    if path.suffix.lower() in STEP:
        path = _without_rest(path, Path(f"{request['output']}.step"))
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    if not gmsh.model.getEntities(3) and gmsh.model.getEntities(2):  # IGES: loose faces
        return gmsh, sew(gmsh)
    return gmsh, {}


def _without_rest(path: Path, copy: Path) -> Path:
    """A STEP file without what follows its end, which may take Open CASCADE minutes to read."""
    data, end, rest = path.read_bytes().partition(b"END-ISO-10303-21;")
    if not rest.strip():
        return path
    copy.write_bytes(data + end + b"\n")
    return copy


def _triangles(
    gmsh: ModuleType, solids: list[int], chosen: int, request: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """Vertices (V, 3), faces (F, 3), and the CAD face of each triangle (F,), from 1.

    Also the name of the solid, and for each CAD face: kind of surface, name or colour, number of
    corners, and all corners in sequence.

    request : the number of `segments`, the `way`, and by what `groups` the faces are named
    """
    gmsh.model.occ.remove([(3, tag) for i, tag in enumerate(solids) if i != chosen], recursive=True)
    gmsh.model.occ.synchronize()
    sides = sorted(tag for _, tag in gmsh.model.getBoundary([(3, solids[chosen])], oriented=False))
    size, way = diagonal(gmsh), request["way"]
    found = _faces(gmsh, solids[chosen], sides, request["groups"])
    number = {side: i for i, side in enumerate(sides, start=1)}
    if request["remove"]:
        from polycube.io.removal.features import Solid  # with SciPy, which takes time to import
        from polycube.io.removal.removing import Removal

        sys.stderr.write(f"{REMOVING}\n")
        path = Path(request["path"])
        named, solid = names(found, path, request["groups"]), Solid(gmsh, solids[chosen], size)
        try:
            removal = Removal(gmsh, solid, request["remove"], named)
        except LookupError as error:
            sys.exit(f"{REFUSED}{error.args[0]}")
        number = removal.number
        found["removed"] = np.array(json.dumps(removal.record(gmsh_lengths(path))))
    sys.stderr.write(f"{TESSELLATING}\n")
    return found | tessellated(gmsh, number, size, request["segments"], way)


def tessellated(
    gmsh: ModuleType, number: Mapping[int, int], size: float, requested: int, way: str = CURVED
) -> dict[str, np.ndarray]:
    """Vertices (V, 3), triangles (F, 3) with the number of their face, and number of segments.

    number : number of each face, by its tag
    size : diagonal of the solids
    requested : number of segments of a full circle
    way : one of `WAYS`
    """
    sides = sorted(number)
    segments = bounded_segments(gmsh, sides, requested, COARSE * size)
    on_turn = {CURVED: segments, EDGES: 0, COARSER: segments / 4}[way]
    gmsh.option.setNumber("Mesh.MeshSizeMax", size if way == COARSER else COARSE * size)
    gmsh.option.setNumber("Mesh.MeshSizeMin", FINE * size)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", on_turn)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", way != CURVED)
    if way == CURVED:
        bound_sizes(gmsh, sides, size, segments, COARSE * size)
    gmsh.model.mesh.generate(2)
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags] = np.arange(len(tags))
    faces = [place[gmsh.model.mesh.getElementsByType(2, side)[1].reshape(-1, 3)] for side in sides]
    return {
        "vertices": points.reshape(-1, 3),
        "faces": np.concatenate(faces),
        "cad_face": np.repeat([number[side] for side in sides], [len(own) for own in faces]),
        "segments": np.array(segments),
    }


def _faces(gmsh: ModuleType, solid: int, sides: list[int], groups: str) -> dict[str, np.ndarray]:
    """The name of a solid, and the kind, name or colour, and corners of each face."""
    ends = [gmsh.model.getBoundary([(2, side)], oriented=False, recursive=True) for side in sides]
    corners = [gmsh.model.getValue(0, tag, []) for own in ends for _, tag in own]
    return {
        "face_kind": np.array([gmsh.model.getType(2, side) for side in sides]),
        "face_name": np.array(_names(gmsh, sides, groups)),
        "solid_name": np.array(name_of(gmsh, 3, solid)),
        "corners": np.reshape(corners, (-1, 3)),
        "n_corners": np.array([len(own) for own in ends]),
    }


def names(found: Mapping[str, np.ndarray], path: Path, by: str) -> Named:
    """The names of a solid and its faces, by Gmsh and by the STEP file.

    found : the arrays of `_faces`
    """
    kinds, names = found["face_kind"].tolist(), tuple(found["face_name"].tolist())
    named = Named(str(found["solid_name"]), names, {}, {})
    if by == "none" or path.suffix.lower() not in STEP:
        return named
    corners = np.split(found["corners"] / gmsh_lengths(path), np.cumsum(found["n_corners"])[:-1])
    own = named_faces(path, kinds, corners, by)
    faces = own.faces if any(own.faces) or own.groups else named.faces
    return own._replace(solid=own.solid or named.solid, faces=faces)


def name_of(gmsh: ModuleType, dimension: int, tag: int) -> str:
    """The name of a face or solid; empty for those that Open CASCADE makes up."""
    name = str(gmsh.model.getEntityName(dimension, tag)).rpartition("/")[2]
    return "" if name.startswith(NO_NAME) else name


def _names(gmsh: ModuleType, sides: list[int], groups: str) -> list[str]:
    """Names of the faces, or their colours such as `colour_ff0000`; empty if there is none."""
    if groups == "name":
        return [name_of(gmsh, 2, side) for side in sides]
    colours = [gmsh.model.getColor(2, side) if groups == "colour" else 4 * (0,) for side in sides]
    return ["colour_{:02x}{:02x}{:02x}".format(*c[:3]) if c[3] else "" for c in colours]


if __name__ == "__main__":
    main()
