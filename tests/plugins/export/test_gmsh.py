"""Gmsh, both versions, read by Gmsh and meshio."""

import subprocess
import sys

import numpy as np
import pytest

from polycube.registry import build
from tests.fixtures.exports import ENDS, corners, export, read

GMSH = """
import json, sys, gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
tags, points, _ = gmsh.model.mesh.getNodes()
kinds, numbers, nodes = gmsh.model.mesh.getElements()
hexes = dict(zip(kinds, nodes))[5]
least = gmsh.model.mesh.getElementQualities(dict(zip(kinds, numbers))[5], "minDetJac")
groups = {}
for dimension, tag in gmsh.model.getPhysicalGroups():
    own = []
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
        for n in gmsh.model.mesh.getElements(dimension, entity)[2]:
            own += n.tolist()
    groups[gmsh.model.getPhysicalName(dimension, tag)] = own
json.dump([tags.tolist(), points.tolist(), hexes.tolist(), min(least), groups], sys.stdout)
"""


@pytest.mark.parametrize(
    ("name", "options"),
    [("gmsh", {"version": "2.2"}), ("gmsh", {}), ("medit", {}), ("nastran", {}), ("vtk", {})],
)
def test_gmsh_reads_it(name, options, mesh, tmp_path):
    pytest.importorskip("meshio")
    import json

    path = export(mesh, tmp_path, name, **options)
    done = subprocess.run([sys.executable, "-c", GMSH, str(path)], capture_output=True, text=True)
    if "ImportError" in done.stderr or "OSError" in done.stderr:
        pytest.skip("gmsh does not load")
    assert done.returncode == 0, done.stderr
    tags, points, hexes, least, groups = json.loads(done.stdout)
    points = np.reshape(points, (-1, 3))[np.argsort(tags)]
    np.testing.assert_allclose(points, mesh.vertices, rtol=1e-9 if name == "nastran" else 0)
    found = np.reshape(hexes, (-1, 8)) - 1
    assert sorted(found.tolist()) == sorted(mesh.hexes.tolist())
    assert least > 0
    cells = {f"cell_{k}_{what}": mesh.cell == k for k, what in enumerate(mesh.primitives)}
    if name == "gmsh":
        for group, own in cells.items():
            assert corners(np.reshape(groups[group], (-1, 8)) - 1) == corners(mesh.hexes[own])
    if name == "gmsh" and not options:
        assert set(groups) == {*mesh.sets, *cells, "primitive_hole_z", "primitive_cube"}
        for group, quads in mesh.sets.items():
            assert corners(np.reshape(groups[group], (-1, 4)) - 1) == corners(mesh.quads[quads])
    elif name == "gmsh":
        assert set(groups) == {*ENDS, "hole_1", *cells}  # a quad is in the first of its sets
        for group in (*ENDS, "hole_1"):
            quads = mesh.quads[mesh.sets[group]]
            assert corners(np.reshape(groups[group], (-1, 4)) - 1) == corners(quads)


def test_meshio_reads_the_groups_of_gmsh(mesh, tmp_path):
    found = read(export(mesh, tmp_path, "gmsh", version="2.2"))
    tags = found.cell_data_dict["gmsh:physical"]
    np.testing.assert_array_equal(tags["hexahedron"], mesh.cell + 1)
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)
    named = {name: tuple(value) for name, value in found.field_data.items()}
    assert named["cell_1_cube"] == (2, 3)
    for name in (*ENDS, "hole_1"):
        tag, dimension = named[name]
        assert dimension == 2
        assert np.flatnonzero(tags["quad"] == tag).tolist() == sorted(mesh.sets[name])


def test_meshio_reads_all_sets_of_gmsh(mesh, tmp_path):
    found = read(export(mesh, tmp_path, "gmsh"))
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)
    sets = found.cell_sets_dict
    for name, quads in mesh.sets.items():
        np.testing.assert_array_equal(sorted(sets[name]["quad"]), sorted(quads))
    for cell, name in enumerate(mesh.primitives):
        own = np.flatnonzero(mesh.cell == cell)
        np.testing.assert_array_equal(sets[f"cell_{cell}_{name}"]["hexahedron"], own)


def test_the_version_may_be_a_string_or_a_number(mesh, tmp_path):
    number = export(mesh, tmp_path, "gmsh", version=4.1).read_text()
    assert number.startswith("$MeshFormat\n4.1 0 8\n")
    assert number == export(mesh, tmp_path, "gmsh", version="4.1").read_text()


def test_an_unsupported_version_is_refused():
    with pytest.raises(ValueError, match=r"version must be one of 2\.2, 4\.1; got '3'"):
        build("export", {"plugin": "gmsh", "version": "3"})
