"""Hexes of 20 and 27 nodes in VTK, Gmsh and Exodus, read by VTK, Gmsh and meshio."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from polycube.spline.second_order import PARAMETERS, hex_elements
from tests.fixtures.exports import read
from tests.fixtures.splines import mapped, meshed_box

GMSH = """
import json, sys, gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
kinds, numbers, _ = gmsh.model.mesh.getElements(3)
[kind], [own] = kinds.tolist(), numbers
points, weights = gmsh.model.mesh.getIntegrationPoints(kind, "Gauss8")
volume = 0
for entity in gmsh.model.getEntities(3):
    _, dets, _ = gmsh.model.mesh.getJacobians(kind, points, entity[1])
    volume += (dets.reshape(-1, len(weights)) @ weights).sum()
least = min(gmsh.model.mesh.getElementQualities(own, "minDetJac"))
quads = gmsh.model.mesh.getElements(2)[0].tolist()
json.dump([kind, quads, volume, least], sys.stdout)
"""


BULGE = 0.3
VOLUME = 4 * (2 + 8 / 3 * BULGE + 16 / 15 * BULGE**2)


@pytest.fixture(scope="module")
def bulging() -> tuple:
    """A block from -1 to 1 with parabolic sides, as straight hexes and as an exact spline."""
    mesh, _ = meshed_box((3, 3, 3))

    def change(x: np.ndarray) -> np.ndarray:
        x = 2 * x - 1
        wide = 1 + BULGE * (1 - x[..., 2:] ** 2)
        return np.concatenate([x[..., :2] * wide, x[..., 2:]], axis=-1)

    bent = replace(mesh, vertices=change(mesh.vertices))
    return replace(bent, sets=boundary_sets(bent)), mapped(mesh, change)


def exported(bulging, folder, name, **options):
    mesh, spline = bulging
    return provide(build("export", {"plugin": name, **options}), spline=spline)(
        mesh, folder / "hex"
    )


@pytest.mark.parametrize(("nodes", "kinds"), [(20, [17, [16]]), (27, [12, [10]])])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_gmsh_reads_curved_hexes_and_finds_the_volume_of_the_spline(
    bulging, version, nodes, kinds, tmp_path
) -> None:
    path = exported(bulging, tmp_path, "gmsh", version=version, nodes=nodes)
    done = subprocess.run([sys.executable, "-c", GMSH, str(path)], capture_output=True, text=True)
    if "ImportError" in done.stderr or "OSError" in done.stderr:
        pytest.skip("gmsh does not load")
    assert done.returncode == 0, done.stderr
    *found, volume, least = json.loads(done.stdout)
    assert found == kinds and least > 0
    assert volume == pytest.approx(VOLUME, rel=1e-12)


@pytest.mark.parametrize("nodes", [20, 27])
def test_meshio_reads_the_nodes_of_gmsh_in_the_order_of_vtk(bulging, nodes, tmp_path) -> None:
    found = read(exported(bulging, tmp_path, "gmsh", nodes=nodes))
    own = hex_elements(*bulging, nodes)
    np.testing.assert_array_equal(found.points, own.points)
    np.testing.assert_array_equal(found.cells_dict[f"hexahedron{nodes}"], own.hexes)
    np.testing.assert_array_equal(found.cells_dict[f"quad{8 if nodes == 20 else 9}"], own.quads)


@pytest.mark.parametrize(("nodes", "kind"), [(20, 25), (27, 29)])
def test_vtk_reads_curved_hexes_with_their_sets(bulging, nodes, kind, tmp_path) -> None:
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(exported(bulging, tmp_path, "vtk", nodes=nodes))
    own = hex_elements(*bulging, nodes)
    assert set(grid.celltypes.tolist()) == {kind}
    np.testing.assert_array_equal(grid.points, own.points)
    np.testing.assert_array_equal(grid.cell_connectivity.reshape(-1, nodes), own.hexes)
    marked = np.flatnonzero(grid.point_data["z_max"])
    quads = own.quads[bulging[0].sets["z_max"]]
    np.testing.assert_array_equal(marked, np.unique(quads))
    reference = pytest.importorskip("vtkmodules.vtkCommonCore").reference
    for parameter, point in zip(PARAMETERS, own.points[own.hexes[5]], strict=False):
        place = np.zeros(3)
        grid.GetCell(5).EvaluateLocation(reference(0), parameter, place, np.zeros(nodes))
        np.testing.assert_allclose(place, point, atol=1e-14)


@pytest.mark.parametrize("nodes", [20, 27])
def test_vtk_reads_curved_hexes_of_exodus_in_its_own_order(bulging, nodes, tmp_path) -> None:
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOExodus import vtkExodusIIReader

    reader = vtkExodusIIReader()
    reader.SetFileName(str(exported(bulging, tmp_path, "exodus", nodes=nodes)))
    reader.UpdateInformation()
    reader.SetGenerateGlobalNodeIdArray(1)
    reader.Update()
    block = reader.GetOutput().GetBlock(0).GetBlock(0)
    number = vtk_to_numpy(block.GetPointData().GetArray("GlobalNodeId")) - 1
    cells = number[vtk_to_numpy(block.GetCells().GetConnectivityArray())].reshape(-1, nodes)
    own = hex_elements(*bulging, nodes)
    np.testing.assert_array_equal(cells, own.hexes)
    points = vtk_to_numpy(block.GetPoints().GetData())
    np.testing.assert_array_equal(points, own.points[number].astype(np.float32))


@pytest.mark.parametrize("name", ["vtk", "gmsh", "exodus"])
def test_other_numbers_of_nodes_are_refused(name) -> None:
    with pytest.raises(ValueError, match="nodes must be a whole number, 8, 20 or 27; got 10"):
        build("export", {"plugin": name, "nodes": 10})
