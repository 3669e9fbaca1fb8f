"""Worker process that reads a mesh by another library: `python -m polycube.io.foreign.parsers`.

meshio may take minutes for a damaged file, and open3d is native code that may crash; both print
messages. The request is read as JSON from the standard input; arrays are written to its .npz file.
"""

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
    """Write the arrays of a file, or one line on standard error that says why it cannot be read."""
    request = json.load(sys.stdin)
    limit(request)
    try:
        found = PARSERS[request["library"]](request["path"])
        with open(request["output"], "wb") as file:
            np.savez(file, allow_pickle=False, **found)
    except (Exception, SystemExit) as error:  # foreign parsers raise whatever broke
        sys.exit(brief(error) if isinstance(error, Exception) else "it is damaged")


def by_meshio(path: str) -> Arrays:
    """Points, type and size of each block of cells, and the nodes of blocks of hexahedra.

    The names `hexes i` and `cell i` contain the number of the block. `cell` is an array of the
    files that this program writes.
    """
    import meshio

    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):  # it prints messages
        mesh = meshio.read(path)
    cells = mesh.cell_data.get("cell", [])
    found = {
        "points": np.asarray(mesh.points),
        "kind": np.array([block.type for block in mesh.cells], str),
        "number": np.array([len(block.data) for block in mesh.cells], np.int64),
    }
    for i, block in enumerate(mesh.cells):
        kind = block.type.lower().removeprefix("vtk_lagrange_")
        if kind.startswith("hexahedron") and len(block.data):
            found[f"hexes {i}"] = np.asarray(block.data)[..., :8]  # corners are first
            if i < len(cells):
                found[f"cell {i}"] = np.asarray(cells[i]).ravel()
    return found


def by_open3d(path: str) -> Arrays:
    """Vertices and triangles; empty if open3d cannot read the file, which it only prints.

    If open3d does not load, `missing` says why.
    """
    try:
        import open3d
    except (ImportError, OSError) as error:
        return {"missing": np.array(str(error))}
    mesh = open3d.io.read_triangle_mesh(Path(path))
    return {"vertices": np.array(mesh.vertices), "faces": np.array(mesh.triangles, dtype=np.int64)}


def by_trimesh(path: str) -> Arrays:
    """Vertices and triangles of a GLB file."""
    import trimesh

    data = Path(path).read_bytes()
    size = int.from_bytes(data[12:16], "little")
    accessors = json.loads(data[20 : 20 + size]).get("accessors", [])
    if sum(each["count"] for each in accessors) > len(data):
        raise ValueError("its accessors have more elements than the file has bytes")
    mesh = trimesh.load_mesh(path, process=False)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    return {"vertices": vertices, "faces": faces}


PARSERS: dict[str, Callable[[str], Arrays]] = {
    "meshio": by_meshio, "open3d": by_open3d, "trimesh": by_trimesh,
}  # fmt: skip

if __name__ == "__main__":
    main()
