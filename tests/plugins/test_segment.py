import numpy as np
import pytest

from polycube.charts.mapped_surface import Sheet, sides, split
from polycube.registry import build
from polycube.structure.lattice import boundary, collapse, lattice
from polycube.structure.projection import majority
from polycube.surface.measures import components, face_normals
from polycube.testing import check_plugin
from polycube.types import Parametrization, TriMesh
from tests.conftest import first_quick
from tests.fixtures.polycubes import PRIMITIVES, TWO, part


@pytest.mark.slow
@pytest.mark.parametrize("plugin", ["nearest", "drawn"])
@pytest.mark.parametrize("context", [("cube", "cube"), ("hole_y", "hole_x")])
def test_a_polycube_is_labelled_with_its_own_faces(context, plugin):
    surface = part(context, np.eye(3))
    polycube = collapse(lattice(TWO, context, PRIMITIVES))
    label = build("meshing/segment", {"plugin": plugin})
    labels = label(surface, polycube, Parametrization(surface.vertices))
    normals = np.vstack([np.eye(3), -np.eye(3)])[[0, 3, 1, 4, 2, 5]][labels.axis]
    np.testing.assert_allclose(face_normals(surface), normals, atol=1e-12)
    assert len(np.unique(labels.patch)) == boundary(polycube).patch.max() + 1
    for patch in np.unique(labels.patch):
        at = surface.vertices[surface.faces[labels.patch == patch]]
        assert np.ptp(at[..., labels.axis[labels.patch == patch][0] // 2]) < 1e-12


def test_labels_are_connected_despite_noise():
    surface = part(("cube", "cube"), np.eye(3))
    noise = 0.02 * np.random.default_rng(0).standard_normal(surface.vertices.shape)
    polycube = collapse(lattice(TWO, ("cube", "cube"), PRIMITIVES))
    label = build("meshing/segment", {"plugin": "nearest"})
    labels = label(surface, polycube, Parametrization(surface.vertices + noise))
    assert len(np.unique(labels.patch)) == 6
    for patch in range(6):
        assert components(surface.faces[labels.patch == patch]).max() == 0


def test_isolated_faces_get_the_label_of_their_neighbours_but_corners_do_not():
    octahedron = TriMesh(
        np.vstack([np.eye(3), -np.eye(3)]),
        [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]],
    )
    lone = np.array([7, 1, 1, 1, 2, 2, 2, 2])
    np.testing.assert_array_equal(majority(lone, octahedron.faces, 5), [1, 1, 1, 1, 2, 2, 2, 2])
    corner = np.array([0, 1, 5, 2, 3, 5, 5, 5])
    assert majority(corner, octahedron.faces, 1)[0] == 0  # its neighbours 1, 2, 3 disagree


@pytest.mark.parametrize("seed", first_quick(1, range(3)))
def test_drawn_labels_are_connected_if_the_closest_are_not(seed):
    surface = refined(part(("cube", "cube"), np.eye(3)))
    noise = 0.12 * np.random.default_rng(seed).standard_normal(surface.vertices.shape)
    polycube = collapse(lattice(TWO, ("cube", "cube"), PRIMITIVES))
    pieces = {}
    for plugin in ("nearest", "drawn"):
        label = build("meshing/segment", {"plugin": plugin})
        labels = label(surface, polycube, Parametrization(surface.vertices + noise))
        patches = [surface.faces[labels.patch == patch] for patch in range(6)]
        pieces[plugin] = sum(components(faces).max() + 1 for faces in patches)
    assert pieces["drawn"] == 6 < pieces["nearest"]


def refined(surface: TriMesh) -> TriMesh:
    """The surface with every edge halved."""
    sheet = Sheet(surface.vertices, surface.vertices, surface.faces, np.zeros(len(surface.faces)))
    found = sides(sheet)
    sheet = split(sheet, found, np.ones(len(found.ends), bool))
    return TriMesh(sheet.vertices, sheet.faces)


def test_drawn_is_a_segmentation():
    check_plugin("meshing/segment", {"plugin": "drawn", "longest": 0.1})
    with pytest.raises(ValueError, match="longest must be a number, above 0; got 0"):
        build("meshing/segment", {"plugin": "drawn", "longest": 0.0})
