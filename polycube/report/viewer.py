"""The hex mesh to turn, cut and filter in a browser; everything it needs stands in the page."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from string import Template

import numpy as np

from polycube.geometry.hexes import FACES, neighbours
from polycube.geometry.quality import scaled_jacobian
from polycube.report.colours import QUALITY_COLOURS, rgb
from polycube.report.render import view
from polycube.types import HexMesh

_HERE = Path(__file__).parent
MOST = 300_000  # hexes; above, the page would be too heavy for a browser


def viewer(mesh: HexMesh) -> str:
    """Markup of the 3D view; empty for a mesh too large to show."""
    if len(mesh.hexes) > MOST:
        return ""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    places = (mesh.vertices - (low + high) / 2) / np.linalg.norm(high - low)
    arrays = (
        places.astype("<f4"),
        mesh.hexes.astype("<i4"),
        beyond(mesh.hexes).astype("<i4"),
        scaled_jacobian(mesh.vertices, mesh.hexes).astype("<f4"),
    )
    packed = zlib.compress(b"".join(array.tobytes() for array in arrays), 9)
    data = {
        "V": len(places),
        "H": len(mesh.hexes),
        "faces": FACES.tolist(),
        "low": places.min(0).tolist(),
        "high": places.max(0).tolist(),
        "view": view().tolist(),
        "extent": np.abs(places @ view().T).max(0).tolist(),
        "colours": rgb(QUALITY_COLOURS).tolist(),
        "data": base64.b64encode(packed).decode(),
    }
    return Template((_HERE / "viewer.html").read_text(encoding="utf-8")).substitute(
        data=json.dumps(data), script=(_HERE / "viewer.js").read_text(encoding="utf-8")
    )


def beyond(hexes: np.ndarray) -> np.ndarray:
    """(H, 6) the hex beyond each face, -1 outside."""
    found = np.full(6 * len(hexes), -1)
    a, b = neighbours(hexes)
    found[a], found[b] = b // 6, a // 6
    return found.reshape(-1, 6)
