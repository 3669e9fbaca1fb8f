import numpy as np
import pytest

from polycube.charts.segmentation import euler, segment
from polycube.errors import MeshingError
from polycube.structure.lattice import boundary, collapse, lattice
from polycube.structure.projection import project_onto
from polycube.types import Labels, Parametrization
from tests.fixtures.charts import given
from tests.fixtures.polycubes import PRIMITIVES, TWO


@pytest.mark.parametrize("context", [("cube", "cube"), ("hole_y", "hole_x"), ("cube", "hole_z")])
def test_a_polycube_is_divided_into_its_own_faces(context):
    surface, polycube, labels, places = given(context)
    found = segment(surface, polycube, labels, Parametrization(places), 0.1).drawing.sheet
    _, face = project_onto(boundary(polycube), found.places[found.faces].mean(axis=1))
    np.testing.assert_array_equal(found.tag, boundary(polycube).patch[face])


@pytest.mark.parametrize("seed", range(4))
def test_topology_is_correct_with_noise_and_useless_labels(seed):
    surface, polycube, labels, places = given(("cube", "hole_z"))
    rng = np.random.default_rng(seed)
    useless = Labels(labels.axis, rng.permutation(labels.patch))
    noisy = places + 0.08 * rng.standard_normal(places.shape)
    found = segment(surface, polycube, useless, Parametrization(noisy), 0.04)
    sheet, outside = found.drawing.sheet, boundary(polycube)
    for patch in range(outside.patch.max() + 1):
        quads = outside.quads[outside.patch == patch]
        assert euler(sheet.faces[sheet.tag == patch]) == euler(quads)


def test_description_of_a_patch():
    surface, polycube, labels, places = given(("cube", "hole_z"))
    found = segment(surface, polycube, labels, Parametrization(places), 0.1)
    outside = boundary(polycube)
    patch = int(outside.patch[outside.axis == 0].min())
    assert found.describe(patch).startswith(f"polycube face {patch} (+x, cell (")


@pytest.mark.slow
def test_a_polycube_of_another_genus_is_refused_by_the_name_of_a_face():
    surface, _, labels, places = given(("cube", "cube"))
    holed = collapse(lattice(TWO, ("cube", "hole_z"), PRIMITIVES))
    with pytest.raises(MeshingError, match=r"polycube face \d+ \([+-][xyz], cell \(\d, 0, 0\)\)"):
        segment(surface, holed, labels, Parametrization(places), 0.1)


def test_euler_numbers():
    assert euler(np.array([[0, 1, 2, 3]])) == 1
    ring = boundary(lattice((1, 1, 1), ("hole_z",), PRIMITIVES))
    assert euler(ring.quads) == 0  # a torus
    assert euler(ring.quads[ring.axis == 4]) == 0  # a ring
