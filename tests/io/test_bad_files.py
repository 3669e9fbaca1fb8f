"""Malformed surfaces: each file is refused in one sentence, or read with a warning.

The table repeats what the collection's manifest demands, as parts of our sentences.
"""

import csv

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.surfaces import read_surface
from polycube.surface.checks import check_surface
from polycube.surface.measures import genus, volume

REFUSED = {
    "open_hole.obj": "not closed: 19 edges",
    "open_one_triangle.stl": "not closed: 3 edges",
    "nonmanifold_edge_fin.obj": "not manifold: 1 edge",
    "nonmanifold_two_cubes_share_edge.obj": r"1 edge .* from \(1, 1, 0\) to \(1, 1, 1\)",
    "nonmanifold_two_cubes_share_vertex.obj": r"not manifold: 1 vertex .* at \(1, 1, 1\)",
    "self_intersecting_two_cubes.obj": "2 separate pieces",
    "nan_coordinate.stl": "must be finite",
    "nan_text.obj": "must be finite numbers: 1 of 498",
    "inf_text.obj": "must be finite",
    "huge_offset.stl": "are at one point",
    "empty.stl": "file is empty",
    "empty_header.stl": "no triangles",
    "empty_solid.stl": "no triangles",
    "truncated_binary.stl": "not a complete STL file: its header gives 4480 triangles",
    "count_too_big.stl": "not a complete STL file: its header gives 4294967295 triangles",
    "truncated_ascii.stl": "not a complete STL file: it ends",
    "text_named.stl": "not an STL file",
    "png_named.stl": "not a complete STL file",
    "obj_named.stl": "not an STL file",
    "point_cloud.obj": "no triangles",
    "index_out_of_range.obj": "vertex 9 of 4",
    "index_zero.obj": "line 5.*vertex index 0",
    "flat_double_sheet.obj": "no volume",
    "klein_bottle.obj": "not orientable",
    "two_components.stl": "2 separate pieces",
    "inner_void.obj": "inner void",
    "inner_void_sphere.obj": "inner void",
    "debris_component.obj": "2 separate pieces, the smallest of 12 faces",
    "real_heart_ddpm.obj": "not closed: 17 edges",
}
TAKEN = {  # file -> genus, part of the warning
    "self_intersecting_rod.stl": (2, "intersects itself"),
    "duplicate_faces.obj": (0, "faces given twice: 338"),
    "duplicate_faces_opposite.obj": (0, "faces given twice: 1,"),
    "inverted_normals.stl": (0, "inside out"),
    "mixed_orientation.obj": (0, "reversed faces with an inward normal: 338 of 1014"),
    "huge_scale.obj": (0, ""),
    "tiny_scale.obj": (0, ""),
    "zero_area_faces_t_junction.obj": (0, "no area: 1,"),
    "zero_area_faces_closed.obj": (0, "two equal corners: 2,"),
    "ok_binary_starting_with_solid.stl": (2, ""),
    "ok_ascii_crlf_upper.stl": (0, ""),
    "ok_quads_negative_indices.obj": (0, ""),
    "ok_unreferenced_vertex.obj": (0, "no face uses: 1"),
    "ok_noisy_soup.stl": (0, "welded corners"),
    "high_genus5.obj": (5, ""),
    "real_cup_ddpm.obj": (2, "196 pairs of faces in 1 place, at"),
    "real_rod_ddpm.obj": (1, "9 pairs of faces in 3 places"),
    "real_ring_ddpm.obj": (1, "26 pairs of faces in 4 places"),
}


def test_tables_cover_the_manifest(testdata):
    with (testdata / "bad" / "manifest.csv").open() as file:
        demanded = {row["file"]: row["expected"] for row in csv.DictReader(file)}
    assert set(demanded) == set(REFUSED) | set(TAKEN)
    must_refuse = {name for name, text in demanded.items() if text.startswith("reject:")}
    assert must_refuse <= set(REFUSED)
    assert {name for name, text in demanded.items() if text == "accept"} <= set(TAKEN)


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_one_sentence(testdata, name):
    with pytest.raises(InputError, match=REFUSED[name]) as caught:
        read_surface(testdata / "bad" / name)
    sentence = str(caught.value)
    assert sentence.startswith(str(testdata / "bad" / name) + ": ")
    assert "\n" not in sentence and ". " not in sentence


@pytest.mark.parametrize("name", TAKEN)
def test_files_that_are_read_with_a_warning(testdata, name):
    handles, message = TAKEN[name]
    surface, warnings = read_surface(testdata / "bad" / name)
    check_surface(surface)
    assert genus(surface) == handles
    assert volume(surface) > 0
    assert len(warnings) == (message != "")
    assert message in "; ".join(warnings)


def test_repaired_copies_equal_the_original(testdata):
    original, _ = read_surface(testdata / "surfaces" / "hepta.obj")
    names = ["duplicate_faces.obj", "inverted_normals.stl", "mixed_orientation.obj"]
    names += ["zero_area_faces_t_junction.obj", "ok_noisy_soup.stl", "ok_unreferenced_vertex.obj"]
    for name in names:
        copy, _ = read_surface(testdata / "bad" / name)
        assert len(copy.vertices) == len(original.vertices)
        assert volume(copy) == pytest.approx(volume(original), rel=1e-6)


@pytest.mark.slow
def test_given_parts_read_without_change(testdata):
    with (testdata / "surfaces" / "manifest.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        surface, warnings = read_surface(testdata / "surfaces" / row["file"])
        assert not warnings, row["file"]
        assert len(surface.faces) == int(row["faces"])
        assert genus(surface) == int(row["genus"])
        size = [float(length) for length in row["bbox"].split("x")]
        assert np.ptp(surface.vertices, axis=0) == pytest.approx(size, rel=1e-3)
        assert volume(surface) == pytest.approx(float(row["volume"]), rel=1e-4)
