"""The mesh that every format writes."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.named_sets import boundary_sets
from polycube.types import HexMesh
from tests.fixtures.exports import ENDS
from tests.fixtures.hexmeshes import hex_box


@pytest.fixture(scope="session")
def mesh() -> HexMesh:
    """Box of 4 x 3 x 3 with a hole along z, bent, in inches, far from the origin.

    Two cells along x; a face of a CAD model that is no whole patch.
    """
    plain = hex_box((4, 3, 3), (4.0, 3.0, 3.0))
    middle = plain.vertices[plain.hexes].mean(axis=1)
    kept = ~((np.abs(middle[:, :2] - [1.5, 1.5]) < 0.1).all(axis=1))
    used, hexes = np.unique(plain.hexes[kept], return_inverse=True)
    plain = hex_mesh(plain.vertices[used], hexes.reshape(-1, 8))
    corners = plain.vertices[plain.quads]
    axis = (np.ptp(corners, axis=1) == 0).argmax(axis=1)
    level = corners[np.arange(len(corners)), 0, axis].astype(int)
    _, patch = np.unique(10 * axis + level, return_inverse=True)
    points = (plain.vertices + 0.05 * np.sin(plain.vertices[:, ::-1])) / 25.4 + 1000.1
    cell = (middle[kept][:, 0] > 2).astype(int)
    made = hex_mesh(points, plain.hexes, plain.quads, patch, cell)
    sets = boundary_sets(made)
    assert [name for name in sets if "patch" not in name] == [*ENDS, "hole_1"]
    sets["cad_face_1"] = np.array([0, 3, 5])
    return replace(made, primitives=("hole_z", "cube"), sets=sets)
