"""Files of points: all formats give the same ones; damaged files are refused."""

import numpy as np
import pytest
import trimesh

from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.io.clouds.reading import is_cloud, read_cloud, read_pcd
from polycube.io.preflight import preflight
from polycube.io.surfaces import read_surface
from polycube.surface.measures import volume
from tests.fixtures.clouds import ball_points
from tests.fixtures.surfaces import box

POINTS = ball_points(300).astype(np.float32).astype(np.float64)  # exact in single precision
HEADER = """# .PCD v0.7
VERSION 0.7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH 2
HEIGHT 1
POINTS 2
DATA {}
"""


def write_ply(path, points=POINTS, encoding="binary"):
    trimesh.PointCloud(points).export(path, encoding=encoding)
    return path


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply_without_faces(tmp_path, encoding):
    path = write_ply(tmp_path / "scan.ply", encoding=encoding)
    assert is_cloud(path)
    assert read_cloud(path).points == pytest.approx(POINTS, abs=1e-7)
    assert not len(read_cloud(path).normals)


def test_ply_with_faces_is_a_surface(tmp_path):
    path = tmp_path / "part.ply"
    trimesh.Trimesh(box().vertices, box().faces, process=False).export(path)
    assert not is_cloud(path)


def test_xyz_with_comments_commas_and_more_columns(tmp_path):
    path = tmp_path / "scan.XYZ"
    path.write_text("# x, y, z, red\n" + "".join(f"{x},{y} {z} 255\n" for x, y, z in POINTS))
    assert np.array_equal(read_cloud(path).points, POINTS)


@pytest.mark.parametrize("form", [{"write_ascii": True}, {}, {"compressed": True}])
def test_pcd_of_open3d(tmp_path, form):
    open3d = pytest.importorskip("open3d", exc_type=ImportError)
    made = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(POINTS))
    made.normals = made.points
    path = tmp_path / "scan.pcd"
    open3d.io.write_point_cloud(str(path), made, **form)
    cloud = read_cloud(path)
    assert cloud.points == pytest.approx(POINTS, abs=1e-9)
    assert cloud.normals == pytest.approx(POINTS, abs=1e-9)


def test_bytes_that_repeat_are_unpacked(tmp_path):
    header = HEADER.replace("4 4 4", "1 1 1").replace("F F F", "U U U").replace("2\n", "3\n")
    body = b"abcabcabc"
    packed = bytes([2, *b"abc", 4 << 5, 2])  # three bytes, then six from three back, which overlap
    sizes = np.array([len(packed), len(body)], "<u4").tobytes()
    path = tmp_path / "scan.pcd"
    path.write_bytes(header.format("binary_compressed").encode() + sizes + packed)
    assert read_pcd(path).points.tolist() == [[ord(c)] * 3 for c in "abc"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (b"", "empty"),
        (HEADER.format("binary").encode() + bytes(23), "ends after 1 of 2 points"),
        (HEADER.format("ascii").encode() + b"1 2 3\n", "holds 1 of 2 points"),
        (HEADER.format("ascii").encode() + b"1 2 3\n4 five 6\n", "not a readable PCD"),
        (HEADER.format("binary_compressed").encode() + bytes(8), "do not hold 2 points"),
        (HEADER.format("zipped").encode(), "unknown form of data"),
        (
            HEADER.replace("POINTS 2", "POINTS 300000000").format("binary_compressed").encode()
            + np.array([8, 12 * 300_000_000], "<u4").tobytes()
            + bytes(8),
            "do not hold 300000000 points",
        ),
        (HEADER.replace("1 1 1", "0 0 0").format("binary").encode(), "not a readable PCD"),
        (HEADER.replace("x y z", "a b c").format("binary").encode() + bytes(24), "has no x"),
        (b"not a cloud at all", "has no"),
    ],
)
def test_a_damaged_pcd_is_refused(tmp_path, text, sentence):
    path = tmp_path / "scan.pcd"
    path.write_bytes(text)
    with pytest.raises(InputError, match=sentence):
        read_surface(path)


@pytest.mark.slow
def test_a_scan_is_read_as_a_surface_and_reported(tmp_path):
    pytest.importorskip("open3d", exc_type=ImportError)
    path = write_ply(tmp_path / "scan.ply", ball_points(2000, outliers=20))
    surface, [sentence] = read_surface(path)
    assert volume(surface) == pytest.approx(4 / 3 * np.pi, rel=0.01)
    assert "reconstructed from 2020 points without" in sentence
    assert preflight(str(path), Cad(), "off").is_usable
