"""The 3D view holds the mesh it was given, and finds what lies beyond each face."""

import base64
import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.page.views import viewer
from polycube.report.pictures.colours import AXIS_COLOURS, rgb
from tests.fixtures.hexmeshes import hex_box


def unpacked(page: str) -> tuple[dict, bytes]:
    """What the script of the view reads."""
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', page)[1])
    return data, zlib.decompress(base64.b64decode(data["data"]))


def test_the_mesh_is_in_the_page(run) -> None:
    mesh = run.hexes
    page = viewer.viewer(mesh, run.surface, run.polycube.context)
    data, raw = unpacked(page)
    n, h = data["V"], data["H"]
    surface = run.surface
    assert (data["S"], data["T"]) == (len(surface.vertices), len(surface.faces))
    # the offsets that viewer.js reads at
    end = 12 * n + 116 * h
    assert len(raw) == end + 12 * data["S"] + 12 * data["T"]
    given = np.frombuffer(raw, "<f4", 3 * data["S"], end).reshape(-1, 3)
    np.testing.assert_allclose(
        given * data["size"] + data["middle"], surface.vertices, atol=1e-5 * data["size"]
    )
    triangles = np.frombuffer(raw, "<i4", 3 * data["T"], end + 12 * data["S"]).reshape(-1, 3)
    np.testing.assert_array_equal(triangles.cumsum(axis=0), surface.faces)
    places = np.frombuffer(raw, "<f4", 3 * n).reshape(n, 3)
    hexes = np.frombuffer(raw, "<i4", 8 * h, 12 * n).reshape(h, 8).cumsum(axis=0)
    others = np.frombuffer(raw, "<i4", 6 * h, 12 * n + 32 * h).reshape(h, 6).cumsum(axis=0)
    np.testing.assert_array_equal(others, viewer.beyond(mesh.hexes))
    numbers = np.frombuffer(raw, "<i4", h, 12 * n + 112 * h).cumsum()
    np.testing.assert_array_equal(numbers, np.arange(len(mesh.hexes)))
    quality = np.frombuffer(raw, "<f4", h, 12 * n + 56 * h)
    distance = np.frombuffer(raw, "<f4", 6 * h, 12 * n + 60 * h).reshape(h, 6)
    cell = np.frombuffer(raw, "<i4", h, 12 * n + 84 * h).cumsum()
    np.testing.assert_array_equal(cell, mesh.cell)
    sets = np.frombuffer(raw, "<i4", 6 * h, 12 * n + 88 * h).reshape(h, 6)
    on_quads = sets[quad_sides(mesh)]
    np.testing.assert_array_equal(sets < 0, distance < 0)
    for name, own in mesh.sets.items():
        is_named = {name in data["sets"][number].split(", ") for number in on_quads[own]}
        assert is_named == {True}
    assert data["set_colours"][on_quads[mesh.sets["x_max"][0]]] == rgb(AXIS_COLOURS)[0].tolist()
    np.testing.assert_array_equal(distance < 0, viewer.beyond(mesh.hexes) >= 0)
    assert data["farthest"] == pytest.approx(distance.max())
    assert [data["names"][i] for i in data["primitive"]] == list(run.polycube.context)
    np.testing.assert_array_equal(hexes, mesh.hexes)
    np.testing.assert_allclose(quality, scaled_jacobian(mesh.vertices, mesh.hexes), atol=1e-6)
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    np.testing.assert_allclose(np.ptp(places, axis=0), np.ptp(mesh.vertices, axis=0) / size, 1e-5)
    np.testing.assert_allclose(
        np.array(data["view"]) @ np.transpose(data["view"]), np.eye(3), atol=1e-12
    )


def test_beyond_is_mutual_and_open_at_the_boundary(run) -> None:
    mesh = run.hexes
    found = viewer.beyond(mesh.hexes)
    assert (found == -1).sum() == len(mesh.quads)
    for hexa, others in enumerate(found):
        for other in others[others >= 0]:
            assert hexa in found[other]
            assert len(set(mesh.hexes[hexa]) & set(mesh.hexes[other])) == 4


def test_a_mesh_too_large_for_a_page_is_left_out() -> None:
    plate = hex_box((400, viewer.MOST // 400 + 1, 1))
    assert viewer.viewer(plate) == ""


def test_of_a_large_mesh_the_boundary_and_the_worst_hexes_are_in_the_page() -> None:
    bricks = (70, 60, 15)
    mesh = hex_box(bricks, bricks)
    inside = (abs(mesh.vertices - [35, 30, 7]) <= [8, 8, 4]).all(axis=1)
    noise = np.random.default_rng(0).uniform(-0.04, 0.04, mesh.vertices.shape)
    mesh = replace(mesh, vertices=mesh.vertices + noise * inside[:, None])  # 18 x 18 x 10 bad hexes
    data, raw = unpacked(viewer.viewer(mesh))
    n, h = data["V"], data["H"]
    inner, least = 68 * 58 * 13, viewer.WORST
    assert (h, data["all"]) == (63_000 - inner + least, 63_000)
    numbers = np.frombuffer(raw, "<i4", h, 12 * n + 112 * h).cumsum()
    hexes = np.frombuffer(raw, "<i4", 8 * h, 12 * n).reshape(h, 8).cumsum(axis=0)
    places = np.frombuffer(raw, "<f4", 3 * n).reshape(n, 3)
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    corners = mesh.vertices[mesh.hexes[numbers]]
    np.testing.assert_allclose(places[hexes] * size, corners - np.divide(bricks, 2), atol=1e-5)
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)
    assert quality.argmin() in numbers
    others = np.frombuffer(raw, "<i4", 6 * h, 12 * n + 32 * h).reshape(h, 6).cumsum(axis=0)
    found = np.where(others < 0, others, numbers[others.clip(0)])
    true = viewer.beyond(mesh.hexes)[numbers]
    np.testing.assert_array_equal(found, np.where(np.isin(true, [-1, *numbers]), true, -2))


def test_the_page_of_60_000_hexes_has_a_view_of_less_than_2_5_MB() -> None:
    mesh = hex_box((50, 40, 30))
    noise = np.random.default_rng(0).normal(size=mesh.vertices.shape)
    mesh = replace(mesh, vertices=mesh.vertices + noise / 1000)
    assert len(viewer.viewer(mesh)) < 2.5e6


def test_results_follow_the_input_surface(run) -> None:
    page = viewer.viewer(run.hexes, run.surface, unit="mm", solved=(run.spline, run.solution))
    data, raw = unpacked(page)
    plain = unpacked(viewer.viewer(run.hexes, run.surface))[1]
    assert [each["title"].split(":")[0] for each in data["results"]] == ["mode 7", "mode 8"]
    assert len(raw) == len(plain) + 2 * (2 + 6) * data["V"]
    for number, each in enumerate(data["results"]):
        assert each["moves"] and f'<option value="result{number}">{each["title"]}' in page
    assert "mm from the input" in page and 'name="deformed"' in page and 'name="input"' in page


def test_without_the_input_there_is_no_distance_to_colour_by(run) -> None:
    page = viewer.viewer(run.hexes)
    assert 'value="quality"' in page and 'value="cell"' in page
    assert 'value="distance"' not in page and 'value="primitive"' not in page
    assert 'name="input"' not in page.split("<script")[0] and unpacked(page)[0]["T"] == 0
