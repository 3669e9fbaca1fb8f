"""Quads of planar regions by Gmsh: `python -m polycube.hexmesh.generation.quad_worker`.

It is a separate process, because Gmsh replaces signal handlers, may crash, and is under the GPL. It
reads a request as JSON from standard input (see `quads.quads`) and writes arrays to .npz files in
the folder given there.
"""

import json
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Algorithm": 8,  # frontal Delaunay for quads
    "Mesh.RecombineAll": 1,
    "Mesh.RecombinationAlgorithm": 0,  # greedy
    "Mesh.SubdivisionAlgorithm": 1,  # all quads
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeExtendFromBoundary": 1,
}
QUAD = 3  # element type
SECONDS = 2  # of the processor, for the quads of a plane
PER_POINT = 4e-3  # the same for each point on its borders


def main() -> None:
    """Make the quads of the requested planes, from the `first` on.

    Writes a file for each that succeeds, and a line to the standard output after each.
    """
    request = json.load(sys.stdin)
    import gmsh

    gmsh.initialize(interruptible=False)
    for name, value in OPTIONS.items():
        gmsh.option.setNumber(name, value)
    for number, plane in list(enumerate(request["planes"]))[request["first"] :]:
        _limit(SECONDS + PER_POINT * len(plane["points"]))
        try:
            made = _quads(gmsh, plane)
        except Exception:  # any exception of Gmsh if it cannot mesh a region
            made = {}
        if made:
            np.savez(Path(request["folder"]) / f"{number}.npz", allow_pickle=False, **made)
        sys.stdout.write(f"{number}\n")
        sys.stdout.flush()
    gmsh.finalize()


def _limit(seconds: float) -> None:
    """End this process if it takes more seconds from here on: Gmsh may not return."""
    if sys.platform != "win32":
        import resource

        until = int(time.process_time() + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (until, resource.RLIM_INFINITY))


def _quads(gmsh: ModuleType, plane: dict[str, Any]) -> dict[str, np.ndarray]:
    """Arrays of the quads of a plane."""
    gmsh.clear()
    gmsh.option.setNumber("Mesh.MeshSizeMax", plane["size"])
    surfaces = _surfaces(gmsh, plane)
    gmsh.model.mesh.generate(2)
    tags, places, _ = gmsh.model.mesh.getNodes()
    row = np.zeros(int(tags.max()) + 1, np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    found = [gmsh.model.mesh.getElementsByType(QUAD, tag)[1] for tag in surfaces]
    faces = row[np.concatenate(found).astype(np.int64)].reshape(-1, 4)
    used, faces = np.unique(faces, return_inverse=True)
    region = np.repeat(np.arange(len(surfaces)), [len(each) // 4 for each in found])
    vertices = places.reshape(-1, 3)[used, :2]
    return {"vertices": vertices, "quads": faces.reshape(-1, 4), "region": region}


def _surfaces(gmsh: ModuleType, request: dict[str, Any]) -> list[int]:
    """Tags of the planar surfaces, bounded by lines between the points."""
    geo = gmsh.model.geo
    points = [geo.addPoint(x, y, 0) for x, y in request["points"]]
    lines: dict[tuple[int, int], int] = {}

    def line(a: int, b: int) -> int:
        if (b, a) in lines:
            return -lines[b, a]
        if (a, b) not in lines:
            lines[a, b] = geo.addLine(points[a], points[b])
        return lines[a, b]

    surfaces = []
    for region in request["regions"]:
        edges = [zip(loop, [*loop[1:], loop[0]], strict=True) for loop in region]
        loops = [geo.addCurveLoop([line(a, b) for a, b in pairs]) for pairs in edges]
        surfaces.append(geo.addPlaneSurface(loops))
    geo.synchronize()
    for tag in lines.values():
        gmsh.model.mesh.setTransfiniteCurve(tag, 2)
    for tag, corners in zip(surfaces, request["corners"], strict=True):
        if corners:
            gmsh.model.mesh.setTransfiniteSurface(tag, "Left", [points[c] for c in corners])
    return surfaces


if __name__ == "__main__":
    main()
