"""Solids that touch, meshed as one part."""

import numpy as np
import pytest

from polycube.assembly.combined import agreements
from polycube.assembly.contacts import contacts
from polycube.assembly.joint_mesh import joint_meshes
from polycube.errors import MeshingError
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.solids.touching import touching
from polycube.registry import build
from polycube.surface.measures import volume as enclosed
from tests.fixtures import assemblies

CUBE = {"cube": np.ones((3, 3, 3), bool)}


def made(name, size, folder):
    """Surfaces of the touching solids of an assembly, and their meshes."""
    [group] = touching(assemblies.write(name, folder), 48)
    config = {"plugin": "sweep", "size": size}
    structure = build("structure", config, grid=(1, 1, 1), primitives=CUBE)
    return [*group.values()], joint_meshes([*group.values()], [structure])


@pytest.mark.slow
def test_three_boxes_fill_their_places_exactly_and_share_vertices(tmp_path):
    _, meshes = made("cubes", 2.5, tmp_path)
    assert [volume(each) for each in meshes] == pytest.approx([1000, 1000, 125], rel=1e-9)
    for mesh, low, high in zip(
        meshes,
        ([0, 0, 0], [10, 0, 0], [3, 3, 10]),
        ([10, 10, 10], [20, 10, 10], [8, 8, 15]),
        strict=True,
    ):
        np.testing.assert_allclose(mesh.vertices.min(axis=0), low, atol=1e-9)
        np.testing.assert_allclose(mesh.vertices.max(axis=0), high, atol=1e-9)
    first, _, third = ({*map(tuple, mesh.vertices.tolist())} for mesh in meshes)
    low = [v for v in third if abs(v[2] - 10) < 1e-9]
    assert len(low) >= 9 and first.issuperset(low)  # to the last bit


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hole_and_pin", "bolted", "hinged"])
def test_round_faces_agree_and_keep_their_features(name, tmp_path):
    surfaces, meshes = made(name, 3.0, tmp_path)
    sets = [with_sets(*pair) for pair in zip(meshes, surfaces, strict=True)]
    found = agreements(*sets, contacts(*surfaces))
    assert found and all(each.is_covered for each in found)
    for mesh, surface in zip(meshes, surfaces, strict=True):
        assert inspect(mesh, surface).n_lost_features == 0
        assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.6
        assert volume(mesh) == pytest.approx(enclosed(surface), rel=0.05)


@pytest.mark.slow
def test_without_a_common_structure_the_error_says_so(tmp_path):
    [group] = touching(assemblies.write("cubes", tmp_path), 24)
    with pytest.raises(MeshingError, match="they are not a sweep or a turned part together"):
        joint_meshes([*group.values()], [lambda surface, candidates: []])
