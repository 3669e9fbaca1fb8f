import numpy as np
import pytest

from polycube.io.bext import CHUNK, write_bext2
from polycube.spline.bezier import bezier_points
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from tests.fixtures.hexmeshes import hex_ball, hex_box
from tests.oracles.bext import read_bext2


def spline_of(mesh):
    return volumetric_spline(mesh, single_hex_edges(mesh))


def test_one_element_is_written_as_the_format_says(tmp_path):
    lines = write_bext2(tmp_path / "a.bxt", spline_of(hex_box((1, 1, 1)))).read_text().splitlines()
    assert lines[0] == "B E X T 2.0"
    assert lines[1] == "       1       8       1       8       0"
    one = "  1.0000000000000000E+00"
    assert lines[9] == one * 4  # the eighth node, of weight 1
    assert [line.split() for line in lines[10:13]] == [["1"], list("1188333"), list("12345678")]
    assert lines[14:16] == ["       1       0", "       8      64"]
    assert len(lines) == 16 + 8 * 13  # five floats a line


@pytest.mark.parametrize("mesh", [hex_box((2, 3, 1)), hex_ball(2)], ids=["box", "ball"])
def test_what_is_read_is_what_was_written(mesh, tmp_path):
    spline = spline_of(mesh)
    found = read_bext2(write_bext2(tmp_path / "a.bxt", spline))
    assert (found.control == spline.control).all()
    theirs, ours = bezier_points(found), bezier_points(spline)
    order = [
        np.lexsort(points[:, [21, 42]].reshape(len(points), -1).round(9).T)
        for points in (theirs, ours)
    ]
    assert np.abs(theirs[order[0]] - ours[order[1]]).max() < 1e-14


@pytest.mark.parametrize("mesh", [hex_box((9, 8, 4)), hex_ball(5)], ids=["box", "ball"])
def test_the_extraction_of_every_element_is_read_back_exactly(mesh, tmp_path):
    assert len(mesh.hexes) > CHUNK  # vectors are shared between chunks too
    spline = spline_of(mesh)
    theirs = read_bext2(write_bext2(tmp_path / "a.bxt", spline)).element_functions()
    ours = spline.element_functions()
    count = np.diff(ours.offsets)
    order = np.argsort(count, kind="stable")  # a block for each number of functions
    assert np.array_equal(np.diff(theirs.offsets), count[order])
    rows = np.concatenate([np.arange(*ours.offsets[[e, e + 1]]) for e in order])
    assert np.array_equal(theirs.functions, ours.functions[rows])
    assert (theirs.coefficients != ours.coefficients[rows]).nnz == 0


def test_equal_vectors_are_written_once(tmp_path):
    lines = write_bext2(tmp_path / "a.bxt", spline_of(hex_box((6, 1, 1)))).read_text().splitlines()
    spline = spline_of(hex_box((6, 1, 1)))
    rows = spline.element_functions().coefficients.toarray()
    assert lines[1].split()[3] == str(len(np.unique(rows, axis=0)))
    assert int(lines[1].split()[3]) < len(rows)


def test_refuses_other_and_short_files(tmp_path):
    path = write_bext2(tmp_path / "a.bxt", spline_of(hex_box((1, 1, 1))))
    text = path.read_text()
    path.write_text(text[:-40])
    with pytest.raises(ValueError, match="ends too early"):
        read_bext2(path)
    path.write_text("B E X T\n" + text)
    with pytest.raises(ValueError, match="is not a BEXT v2 file: it begins 'B E X T'"):
        read_bext2(path)
