"""Exodus, read by VTK and by its own definition."""

import numpy as np
import pytest

from tests.fixtures.exports import corners, export, nodes_of


def test_vtk_reads_exodus(mesh, tmp_path):
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOExodus import vtkExodusIIReader

    reader = vtkExodusIIReader()
    reader.SetFileName(str(export(mesh, tmp_path, "exodus")))
    reader.UpdateInformation()
    kinds = (reader.ELEM_BLOCK, reader.SIDE_SET, reader.NODE_SET)
    for kind in kinds:
        for k in range(reader.GetNumberOfObjects(kind)):
            reader.SetObjectStatus(kind, k, 1)
    reader.SetGenerateGlobalElementIdArray(1)
    reader.SetGenerateGlobalNodeIdArray(1)
    reader.Update()
    output = reader.GetOutput()
    filled = [output.GetBlock(i) for i in range(output.GetNumberOfBlocks())]
    blocks, sides, nodes = [b for b in filled if b is not None and b.GetNumberOfBlocks()]
    names_of = [
        [reader.GetObjectName(k, i) for i in range(reader.GetNumberOfObjects(k))] for k in kinds
    ]
    assert names_of == [["cell_0_hole_z", "cell_1_cube"], list(mesh.sets), list(mesh.sets)]

    def grid(of, k):
        """Points, cells as numbers of the points in the mesh."""
        piece = of.GetBlock(k)
        number = vtk_to_numpy(piece.GetPointData().GetArray("GlobalNodeId")) - 1
        points = vtk_to_numpy(piece.GetPoints().GetData())
        np.testing.assert_array_equal(points, mesh.vertices[number].astype(np.float32))  # VTK's
        return piece, number[vtk_to_numpy(piece.GetCells().GetConnectivityArray())]

    for k in range(2):
        piece, cells = grid(blocks, k)
        own = vtk_to_numpy(piece.GetCellData().GetArray("GlobalElementId")) - 1
        np.testing.assert_array_equal(cells.reshape(-1, 8), mesh.hexes[own])
        assert own.tolist() == np.flatnonzero(mesh.cell == k).tolist()
    for k, (name, quads) in enumerate(mesh.sets.items()):
        faces = grid(sides, k)[1].reshape(-1, 4)
        assert corners(faces) == corners(mesh.quads[quads]), name
        assert np.unique(grid(nodes, k)[1]).tolist() == nodes_of(mesh, name)


def test_normals_of_exodus_sides_point_outwards(mesh, tmp_path):
    """Sides by the manual of Exodus II, table of HEX: 1265 2376 3487 1584 1432 5678 (corners)."""
    from scipy.io import netcdf_file

    manual = (
        np.array([list(map(int, side)) for side in "1265 2376 3487 1584 1432 5678".split()]) - 1
    )
    with netcdf_file(export(mesh, tmp_path, "exodus"), mmap=False) as file:
        hexes = np.concatenate([file.variables[f"connect{k}"][:] for k in (1, 2)]) - 1
        for k, quads in enumerate(mesh.sets.values(), start=1):
            element, side = (file.variables[f"{what}_ss{k}"][:] - 1 for what in ("elem", "side"))
            found = hexes[element[:, None], manual[side]]
            turned = [np.roll(row, -row.argmin()).tolist() for row in found]
            given = [np.roll(row, -row.argmin()).tolist() for row in mesh.quads[quads]]
            assert sorted(turned) == sorted(given)
        points = np.stack([file.variables[f"coord{axis}"][:] for axis in "xyz"], axis=1)
        np.testing.assert_array_equal(points, mesh.vertices)
