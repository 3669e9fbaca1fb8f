"""The 3D view holds the mesh it was given, and finds what lies beyond each face."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

from polycube.geometry.quality import scaled_jacobian
from polycube.report import viewer


def test_the_mesh_is_in_the_page(run) -> None:
    mesh = run["hexes"]
    page = viewer.viewer(mesh)
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', page)[1])
    raw = zlib.decompress(base64.b64decode(data["data"]))
    n, h = data["V"], data["H"]
    assert len(raw) == 12 * n + 60 * h  # the offsets that viewer.js reads at
    places = np.frombuffer(raw, "<f4", 3 * n).reshape(n, 3)
    hexes = np.frombuffer(raw, "<i4", 8 * h, 12 * n).reshape(h, 8)
    quality = np.frombuffer(raw, "<f4", h, 12 * n + 56 * h)
    np.testing.assert_array_equal(hexes, mesh.hexes)
    np.testing.assert_allclose(quality, scaled_jacobian(mesh.vertices, mesh.hexes), atol=1e-6)
    size = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    np.testing.assert_allclose(np.ptp(places, axis=0), np.ptp(mesh.vertices, axis=0) / size, 1e-5)
    np.testing.assert_allclose(
        np.array(data["view"]) @ np.transpose(data["view"]), np.eye(3), atol=1e-12
    )


def test_beyond_is_mutual_and_open_at_the_boundary(run) -> None:
    mesh = run["hexes"]
    found = viewer.beyond(mesh.hexes)
    assert (found == -1).sum() == len(mesh.quads)
    for hexa, others in enumerate(found):
        for other in others[others >= 0]:
            assert hexa in found[other]
            assert len(set(mesh.hexes[hexa]) & set(mesh.hexes[other])) == 4


def test_a_mesh_too_large_for_a_page_is_left_out(run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "MOST", len(run["hexes"].hexes) - 1)
    assert viewer.viewer(run["hexes"]) == ""
