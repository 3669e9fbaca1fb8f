"""Read a mesh by another library: `python -m polycube.io.foreign.parsers`, a process of its own.

meshio may read a damaged file for minutes, open3d is native code that may crash; both print.
Reads a request as JSON on standard input; writes arrays to the .npz it names.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

from polycube.errors import brief
from polycube.io.foreign.process import limit

Arrays = dict[str, np.ndarray]


def main() -> None:
    """The arrays of a file, or on standard error one line why there are none."""
    request = json.load(sys.stdin)
    limit(request)
    try:
        found = PARSERS[request["library"]](request["path"])
        with open(request["output"], "wb") as file:
            np.savez(file, allow_pickle=False, **found)
    except (Exception, SystemExit) as error:  # foreign parsers raise whatever broke
        sys.exit(brief(error) if isinstance(error, Exception) else "it is damaged")


def by_meshio(path: str) -> Arrays:
    """Points, and of each block of cells its kind and number; the nodes of those of hexahedra.

    `hexes` and `cell` have the number of their block: `cell` is the array of our own files.
    """
    import meshio

    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):  # it talks
        mesh = meshio.read(path)
    cells = mesh.cell_data.get("cell", [])
    found = {
        "points": np.asarray(mesh.points),
        "kind": np.array([block.type for block in mesh.cells], str),
        "number": np.array([len(block.data) for block in mesh.cells], np.int64),
    }
    for i, block in enumerate(mesh.cells):
        if block.type == "hexahedron" and len(block.data):
            found[f"hexes {i}"] = np.asarray(block.data)
            if i < len(cells):
                found[f"cell {i}"] = np.asarray(cells[i]).ravel()
    return found


def by_open3d(path: str) -> Arrays:
    """Vertices and triangles, none where it could not read them, which it only prints."""
    try:
        import open3d
    except (ImportError, OSError) as error:
        raise ImportError(f"open3d does not load: {error}") from None
    mesh = open3d.io.read_triangle_mesh(Path(path))
    return {
        "vertices": np.array(mesh.vertices),
        "faces": np.array(mesh.triangles, dtype=np.int64),
    }


PARSERS: dict[str, Callable[[str], Arrays]] = {"meshio": by_meshio, "open3d": by_open3d}

if __name__ == "__main__":
    main()
