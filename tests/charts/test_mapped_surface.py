import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.charts.mapped_surface import Sheet, refine, sides, split
from polycube.surface.measures import area_vectors, face_areas, genus, is_closed, volume
from polycube.types import TriMesh
from tests.fixtures.charts import sheet
from tests.fixtures.surfaces import box, torus


def surface_of(found: Sheet) -> TriMesh:
    return TriMesh(found.vertices, found.faces)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_splitting_any_edges_preserves_the_shape(seed, share):
    before = sheet(torus(8, 5))
    found = sides(before)
    marked = np.random.default_rng(seed).random(len(found.ends)) < share
    after = split(before, found, marked)
    np.testing.assert_array_equal(after.vertices[: len(before.vertices)], before.vertices)
    middles = before.vertices[found.ends[marked]].mean(axis=1)
    np.testing.assert_allclose(after.vertices[len(before.vertices) :], middles)
    assert is_closed(after.faces) and genus(surface_of(after)) == 1
    pieces = np.zeros((len(before.faces), 3))
    np.add.at(pieces, after.tag, area_vectors(surface_of(after)))
    np.testing.assert_allclose(pieces, area_vectors(surface_of(before)), atol=1e-12)
    assert (face_areas(surface_of(after)) > 0).all()


def test_positions_of_new_vertices_are_means():
    before = sheet(box())
    after = split(before, sides(before), np.ones(18, bool))
    np.testing.assert_array_equal(after.places, after.vertices)
    assert len(after.faces) == 48


def test_refined_edges_are_short_and_the_volume_is_preserved():
    found = refine(sheet(box(high=(3, 1, 0.1))), 0.3)
    assert 0.15 < sides(found).length.max() <= 0.3
    np.testing.assert_allclose(volume(surface_of(found)), 0.3)


def test_a_box_is_sharp_at_its_twelve_edges_only():
    found = sides(refine(sheet(box()), 0.3))
    np.testing.assert_allclose(found.length[found.sharp].sum(), 12)
    assert not sides(sheet(torus(48, 24))).sharp.any()


def test_sides_inside_a_mask_of_faces():
    found = sides(sheet(box()))
    only = np.arange(12) == 3
    np.testing.assert_array_equal(np.flatnonzero(found.inside(only)), np.sort(found.of_face[3]))
