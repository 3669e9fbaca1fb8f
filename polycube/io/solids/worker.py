"""List the solids of a CAD file with gmsh: `python -m polycube.io.solids.worker`.

Reads a request as JSON from standard input and writes JSON to the given file, as `cad_worker`.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from polycube.io.cad_worker import name_of, opened
from polycube.io.solids import motions
from polycube.io.solids.motions import EDGE, FACE, SAME, VERTEX, Landmarks, Motion

SHAPES = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")  # kinds that are distinguished
ACROSS = (np.arange(5) + 0.5) / 5  # parameters of the sample points of a face


@dataclass(frozen=True, eq=False)
class _Solid:
    """A solid with its faces, tags of gmsh, and points (N, 3) on each face."""

    tag: int
    faces: list[int]
    landmarks: Landmarks
    on_faces: list[np.ndarray]


def main() -> None:
    """Names and volumes in `gmsh_unit`; first identical solid of each."""
    request = json.load(sys.stdin)
    gmsh, _ = opened(request)
    distinct: list[tuple[int, _Solid]] = []
    rows = []
    for number, (_, tag) in enumerate(gmsh.model.getEntities(3), start=1):
        solid = _solid(gmsh, tag)
        row = {"name": name_of(gmsh, 3, tag), "volume": gmsh.model.occ.getMass(3, tag)}
        for earlier, known in distinct:
            motion = _motion(gmsh, known, solid)
            if motion is not None:
                row["same_as"] = earlier
                row |= {name: value.tolist() for name, value in vars(motion).items()}
                break
        else:
            distinct.append((number, solid))
        rows.append(row)
    Path(request["output"]).write_text(json.dumps(rows))
    gmsh.finalize()


def _solid(gmsh: ModuleType, tag: int) -> _Solid:
    occ = gmsh.model.occ
    faces = sorted(face for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False))
    edges, vertices = (
        sorted({each for _, each in gmsh.model.getBoundary(below, False, False, recursive)})
        for below, recursive in (([(2, face) for face in faces], way) for way in (False, True))
    )
    edges = [edge for edge in edges if occ.getMass(1, edge) > 0]
    kinds = [gmsh.model.getType(2, face) for face in faces]
    shapes = [(*SHAPES, kind).index(kind) for kind in kinds]  # the same for all other kinds
    keys = [
        *((VERTEX, 0, 0) for _ in vertices),
        *((EDGE, occ.getMass(1, edge), 0) for edge in edges),
        *((FACE, occ.getMass(2, f) ** 0.5, shape) for f, shape in zip(faces, shapes, strict=True)),
    ]
    points = [
        *(gmsh.model.getValue(0, vertex, []) for vertex in vertices),
        *(occ.getCenterOfMass(1, edge) for edge in edges),
        *(occ.getCenterOfMass(2, face) for face in faces),
    ]
    found = motions.landmarks(
        occ.getMass(3, tag),
        np.array(occ.getCenterOfMass(3, tag)),
        np.reshape(occ.getMatrixOfInertia(3, tag), (3, 3)),
        np.array(points),
        np.array(keys),
    )
    return _Solid(tag, faces, found, [_on_face(gmsh, face) for face in faces])


def _on_face(gmsh: ModuleType, face: int) -> np.ndarray:
    """Points (N, 3) on a face, evenly spaced in its parameters."""
    low, high = gmsh.model.getParametrizationBounds(2, face)
    u, v = np.meshgrid(*(a + (b - a) * ACROSS for a, b in zip(low, high, strict=True)))
    where = np.stack([u.ravel(), v.ravel()], axis=1)
    inside = [pair for pair in where if gmsh.model.isInside(2, face, pair, parametric=True)]
    return np.reshape(gmsh.model.getValue(2, face, np.ravel(inside)), (-1, 3))


def _motion(gmsh: ModuleType, first: _Solid, second: _Solid) -> Motion | None:
    """The motion from one solid to another, checked on all faces; None if there is none."""
    for motion in motions.motions(first.landmarks, second.landmarks):
        pairs = zip(first.on_faces, (second.faces[k] for k in motion.faces), strict=True)
        near = SAME * first.landmarks.size
        if all(_lie_on(gmsh, motion(points), face, near) for points, face in pairs):
            return motion
    return None


def _lie_on(gmsh: ModuleType, points: np.ndarray, face: int, near: float) -> bool:
    if not len(points):
        return True
    closest = gmsh.model.getClosestPoint(2, face, points.ravel())[0].reshape(-1, 3)
    return bool(np.linalg.norm(closest - points, axis=1).max() <= near)


if __name__ == "__main__":
    main()
