"""Polygons of mesh files: the same triangles in every format, inside of each polygon."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import InputError
from polycube.io.polygons.division import triangulated
from polycube.io.surfaces import read_soup, read_surface
from polycube.surface.measures import volume
from tests.conftest import first_quick

DART = [(0, 0), (4, 0), (1, 1), (0, 4)]
COMB = [(0, 0), (5, 0), (5, 4), (4, 4), (4, 1), (3, 1), (3, 4), (2, 4), (2, 1), (1, 1), (1, 4)]
COMB += [(0, 4)]
FRAME = [(0, 0), (3, 0), (3, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)]
AREAS = {"dart": (DART, 4.0), "comb": (COMB, 14.0), "frame": (FRAME, 8.0)}
INTO = [(0, 0), (1, 0), (0, 1), (1, 1), (-1, 0.5), (0.5, 2), (0.5, -1)]  # crosses itself


def prism(outline) -> tuple[np.ndarray, list[list[int]]]:
    n = len(outline)
    points = np.array([(x, y, z) for z in (0, 1) for x, y in outline], float)
    ends = [list(range(n))[::-1], list(range(n, 2 * n))]
    sides = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    return points, ends + sides


def write_obj(path: Path, points, polygons) -> None:
    lines = [f"v {x} {y} {z}" for x, y, z in points]
    lines += ["f " + " ".join(f"{i + 1}/1/1" for i in polygon) for polygon in polygons]
    path.write_text("\n".join(lines))


def write_off(path: Path, points, polygons) -> None:
    lines = ["COFF # with colours", f"{len(points)} {len(polygons)} 0", ""]
    lines += [f"{x} {y} {z} 255 0 0 255" for x, y, z in points]
    lines += [f"{len(polygon)} {' '.join(map(str, polygon))} 0.5 0.5 0.5" for polygon in polygons]
    path.write_text("\n".join(lines))


def write_ply(path: Path, points, polygons, order="ascii") -> None:
    """With a colour before the corners, a second list after them, and an element in front."""
    head = ["ply", "comment older", f"format {order} 1.0", "element camera 1", "property float v"]
    head += [f"element vertex {len(points)}", *(f"property float {axis}" for axis in "xyz")]
    head += [f"element face {len(polygons)}", "property uchar red"]
    head += ["property list uchar int vertex_indices", "property list uchar float texcoord"]
    data = "\n".join([*head, "end_header\n"]).encode()
    rows = [("f", [7.0]), *(("fff", row) for row in points.tolist())]
    for polygon in polygons:
        rows.append((f"BB{len(polygon)}iB2f", [9, len(polygon), *polygon, 2, 0.25, 0.75]))
    if order == "ascii":
        data += "\n".join(" ".join(map(str, values)) for _, values in rows).encode()
    else:
        mark = ">" if "big" in order else "<"
        data += b"".join(struct.pack(mark + kind, *values) for kind, values in rows)
    path.write_bytes(data)


WAYS = {
    "a.obj": write_obj,
    "a.off": write_off,
    "a.ply": write_ply,
    "b.ply": lambda *given: write_ply(*given, "binary_little_endian"),
    "c.ply": lambda *given: write_ply(*given, "binary_big_endian"),
}


@pytest.mark.parametrize("shape", first_quick(1, AREAS))
def test_all_formats_give_the_same_triangles(shape, tmp_path):
    points, polygons = prism(AREAS[shape][0])
    found = {}
    for name, write in WAYS.items():
        write(tmp_path / name, points, polygons)
        found[name] = read_soup(tmp_path / name)
    for soup in found.values():
        np.testing.assert_array_equal(soup.vertices, points)
        np.testing.assert_array_equal(soup.faces, found["a.obj"].faces)


@pytest.mark.parametrize("name", WAYS)
@pytest.mark.parametrize("shape", ["dart", "comb"])
def test_concave_prisms_have_their_volume(shape, name, tmp_path):
    outline, area = AREAS[shape]
    WAYS[name](tmp_path / name, *prism(outline))
    surface, warnings = read_surface(tmp_path / name)
    assert warnings == [] and volume(surface) == pytest.approx(area, rel=1e-12)


def areas(points, faces) -> np.ndarray:
    a, b, c = np.moveaxis(points[faces], 1, 0)
    return np.cross(b - a, c - a)[:, 2] / 2


@pytest.mark.parametrize("shape", AREAS)
def test_triangles_fill_the_polygon_once(shape):
    outline, area = AREAS[shape]
    points = np.array([(x, y, 0) for x, y in outline], float)
    faces = triangulated(points, np.arange(len(points)), np.array([len(points)])).faces
    assert len(faces) == len(points) - 2
    assert (areas(points, faces) >= 0).all() and areas(points, faces).sum() == area


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 60), st.booleans())
def test_any_star_is_filled_in_any_position(seed, n, is_clockwise):
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(0, 0.9, n)) / n
    radius = rng.uniform(0.05, 1, n)
    star = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    ring = np.arange(n)[:: -1 if is_clockwise else 1]
    x, y = star[:, 0], star[:, 1]
    exact = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
    faces = triangulated(star @ turn.T + 5, ring, np.array([n])).faces
    own = areas(star, faces) * (-1 if is_clockwise else 1)
    assert len(faces) == n - 2 and own.min() > -1e-12
    assert own.sum() == pytest.approx(exact, rel=1e-9)


def test_a_polygon_that_crosses_itself_is_refused():
    points = np.array([(x, y, 0) for x, y in INTO], float)
    with pytest.raises(InputError, match=r"polygon of 7 corners at .* crosses itself"):
        triangulated(points, np.arange(7), np.array([7]))


def test_a_polygon_of_too_many_corners_is_refused_at_once():
    n = 80_000
    angle, radius = 2 * np.pi * np.arange(n) / n, 1 + np.arange(n) % 2
    star = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    with pytest.raises(InputError, match=r"80000 corners .* too many; split it up"):
        triangulated(star, np.arange(n), np.array([n]))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "no x, y"),
        ("ply\nelement vertex 1\nend_header\n", "expected one of .format"),
        ("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "negative dimensions"),
        ("ply\nformat ascii 1.0\nelement face 1\nproperty list char int vertex_index\n"
         "end_header\n-3 1 2 3\n", "vertex_index.*malformed"),
        ("ply\nformat ascii 1.0\nelement face 99999999\nproperty list int int vertex_index\n"
         "end_header\n0\n", "more elements than the file has bytes"),
        ("ply\nformat text 1.0\nend_header\n", "not a readable PLY"),
        ("ply\nformat ascii 1.0\n", "early end-of-file"),
    ],
)  # fmt: skip
def test_broken_ply(text, sentence, tmp_path):
    path = tmp_path / "part.ply"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_surface(path)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("OFF\n3 1 0\n0 0 0\n", "3 vertices and 1 faces .* 1 lines follow"),
        ("OFF\n1 1 0\n0 0 0\n3 0 0\n", "fewer corners"),
        ("OFF\n1 1 0\n0 0 x\n3 0 0 0\n", "not a readable OFF"),
        ("OFF BINARY\n", "not an OFF file in text"),
        ("OFF\n1 1 0\n0 0 0\n3 0 0 2\n", "vertex 3 of 1"),
    ],
)
def test_broken_off(text, sentence, tmp_path):
    path = tmp_path / "part.off"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_surface(path)
