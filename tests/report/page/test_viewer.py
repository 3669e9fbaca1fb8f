"""The 3D view holds the mesh it was given, and finds what lies beyond each face."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.page import viewer
from polycube.report.pictures.colours import AXIS_COLOURS, rgb


def test_the_mesh_is_in_the_page(run) -> None:
    mesh = run.hexes
    page = viewer.viewer(mesh, run.surface, run.polycube.context)
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', page)[1])
    raw = zlib.decompress(base64.b64decode(data["data"]))
    n, h = data["V"], data["H"]
    assert len(raw) == 12 * n + 112 * h  # the offsets that viewer.js reads at
    places = np.frombuffer(raw, "<f4", 3 * n).reshape(n, 3)
    hexes = np.frombuffer(raw, "<i4", 8 * h, 12 * n).reshape(h, 8)
    quality = np.frombuffer(raw, "<f4", h, 12 * n + 56 * h)
    distance = np.frombuffer(raw, "<f4", 6 * h, 12 * n + 60 * h).reshape(h, 6)
    cell = np.frombuffer(raw, "<i4", h, 12 * n + 84 * h)
    np.testing.assert_array_equal(cell, mesh.cell)
    sets = np.frombuffer(raw, "<i4", 6 * h, 12 * n + 88 * h).reshape(h, 6)
    on_quads = sets[quad_sides(mesh)]
    np.testing.assert_array_equal(sets < 0, distance < 0)
    for name, own in mesh.sets.items():
        told = {name in data["sets"][number].split(", ") for number in on_quads[own]}
        assert told == {True}
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


def test_a_mesh_too_large_for_a_page_is_left_out(run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "MOST", len(run.hexes.hexes) - 1)
    assert viewer.viewer(run.hexes) == ""


def test_without_the_input_there_is_no_distance_to_colour_by(run) -> None:
    page = viewer.viewer(run.hexes)
    assert 'value="quality"' in page and 'value="cell"' in page
    assert 'value="distance"' not in page and 'value="primitive"' not in page
