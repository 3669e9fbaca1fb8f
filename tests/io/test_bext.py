import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from polycube.io import bext
from polycube.io.bext import write_bext, write_bext2
from polycube.spline.bezier import bezier_points
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import single_hex_edges
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.oracles.bext import read_bext


def spline_of(mesh):
    return volumetric_spline(mesh, single_hex_edges(mesh))


SOLIDS = {"box": hex_box((3, 3, 3)), "cylinder": hex_cylinder(), "ball": hex_ball()}


@pytest.mark.parametrize("name", SOLIDS)
def test_what_is_read_equals_what_was_written(name, tmp_path):
    spline = spline_of(SOLIDS[name])
    path = write_bext(tmp_path / "part.bext", spline)
    read = read_bext(path)
    assert np.array_equal(read.control, spline.control)
    assert read.extraction.shape == spline.extraction.shape  # nodes shared as before
    one, other = (s.extraction[s.nodes.ravel()] for s in (spline, read))
    assert (one != other).nnz == 0
    assert bezier_points(read) == pytest.approx(bezier_points(spline), abs=1e-15)


def test_layout_of_the_file(tmp_path):
    mesh = hex_box((4, 4, 4), (1.0, 1 / 3, 3.0))
    lines = write_bext(tmp_path / "part.bext", spline_of(mesh)).read_text().splitlines()
    assert lines[:4] == ["B E X T", "type hex", "nodeN 125", "elemN 64"]
    assert lines[4] == "gnode 0 0 0 1"
    assert lines[9] == "gnode 0 0.083333333333333329 0 1"
    assert lines[129] == "belem 27 3 3 3"
    assert lines[130].split()[:4] == ["0", "1", "2", "5"]
    rows = [line.split() for line in lines[131:158]]
    assert {row[0] for row in rows} == {"s", "d"}
    for row in rows:
        if row[0] == "s":
            assert 0 < int(row[1]) <= 20 and len(row) == 2 + 2 * int(row[1])
        else:
            assert len(row) == 65 and sum(word != "0" for word in row[1:]) > 20
    assert sum(line.startswith("belem") for line in lines) == 64


@pytest.mark.slow
@pytest.mark.parametrize(("write", "share"), [(write_bext, 0.02), (write_bext2, 0.8)])
def test_memory_hardly_grows_with_the_file(write, share, tmp_path, monkeypatch):
    monkeypatch.setattr(bext, "CHUNK", 8)
    sizes, peaks = [], []
    for length in (8, 8, 32):  # the first one imports
        spline = spline_of(hex_box((3, 3, length)))
        tracemalloc.start()
        sizes.append(write(tmp_path / "a", spline).stat().st_size)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] - peaks[1] < share * (sizes[2] - sizes[1])


TINY = "B E X T\ntype hex\nnodeN 1\nelemN 1\ngnode 1 2 3 1.\nbelem 1 3 3 3\n0\n"


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "tiny.bext"


def test_reads_dense_and_sparse_rows(path):
    for row in ("d " + "1 " * 64, "s 64 " + " ".join(f"{i} 1." for i in range(64))):
        path.write_text(TINY + row)
        spline = read_bext(path)
        assert bezier_points(spline) == pytest.approx(np.tile([1.0, 2, 3], (1, 64, 1)))
        assert spline.extraction.shape == (1, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("B E X T", "B E X T 2.0", "expected 'type', found '2.0'"),
        ("type hex", "type quad", "expected 'hex', found 'quad'"),
        ("3 3 3", "2 2 2", "expected '3', found '2'"),
        ("3 1.", "3 0.5", "expected weight 1, found 0.5"),
        ("nodeN 1", "nodeN one", "invalid literal"),
        ("elemN 1", "elemN 2", "ends too early"),
        ("s 1 0 1", "s 2 0 1", "ends too early"),
        ("s 1 0 1", "s 1 64 1", "Bezier index 64"),
        ("\n0\n", "\n1\n", "function 1"),
    ],
)
def test_refuses_other_files_with_a_reason(path, old, new, message):
    text = TINY + "s 1 0 1"
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=message):
        read_bext(path)


def test_a_failed_write_leaves_the_old_file(path):
    path.write_text("old")
    with pytest.raises(AttributeError):
        write_bext(path, None)
    assert path.read_text() == "old"
