"""Legacy VTK and VTU, read by VTK."""

import numpy as np
import pytest

from polycube.io.vtk import write_hex_vtu
from tests.fixtures.exports import ENDS, corners, export, nodes_of


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_vtk_reads_data_and_sets(suffix, mesh, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = (
        export(mesh, tmp_path, "vtk")
        if suffix == "vtk"
        else write_hex_vtu(tmp_path / "hex.vtu", mesh, mesh.primitives)
    )
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.points, mesh.vertices)
    np.testing.assert_array_equal(grid.cell_data["cell"], mesh.cell)
    np.testing.assert_array_equal(grid.cell_data["primitive"], 1 - mesh.cell)
    verdict = grid.cell_quality(["scaled_jacobian"]).cell_data["scaled_jacobian"]
    np.testing.assert_allclose(grid.cell_data["scaled_jacobian"], verdict, atol=1e-12)
    assert grid.compute_cell_sizes()["Volume"].min() > 0
    #: VTK's numbers of the faces of a hexahedron, by vtkHexahedron.h
    faces = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
    for name in (*ENDS, "hole_1", "cad_face_1"):
        assert np.flatnonzero(grid.point_data[name]).tolist() == nodes_of(mesh, name)
        on = [
            mesh.hexes[grid.cell_data[name] >> k & 1 == 1][:, face] for k, face in enumerate(faces)
        ]
        assert corners(np.concatenate(on)) == corners(mesh.quads[mesh.sets[name]])
    assert "patch_0" not in grid.array_names
