"""Read the points of a scan, with normals if the file contains them.

open3d reads all of these formats, but it returns the readable part of a damaged file without an
error.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief
from polycube.io.clouds.pcd import read_pcd
from polycube.io.polygons.ply import is_points, read_columns
from polycube.surface.clouds.points import Cloud

NORMAL = ("nx", "ny", "nz")


def is_cloud(path: Path) -> bool:
    """Whether a file contains points only; decided by its suffix and, for PLY, by its header."""
    suffix = path.suffix.lower()
    if suffix == ".ply" and path.is_file():
        return is_points(path)
    return suffix in READERS and not path.is_dir()


def read_cloud(path: Path) -> Cloud:
    """Points of a file, unchanged.

    Raises
    ------
    InputError
        If the file is empty, damaged or of an unknown kind.
    """
    if not path.read_bytes().strip():
        raise InputError("the file is empty")
    return READERS[path.suffix.lower()](path)


def _read_ply(path: Path) -> Cloud:
    columns = read_columns(path)[0]
    points, normals = (
        np.array([columns.get(name, []) for name in names]).T for names in ("xyz", NORMAL)
    )
    return Cloud(points, normals if columns.keys() >= {*NORMAL} else np.zeros((0, 3)))


def _read_xyz(path: Path) -> Cloud:
    text = path.read_text(encoding="latin-1").replace(",", " ")
    try:
        rows = np.loadtxt(text.splitlines(), ndmin=2, usecols=(0, 1, 2))
    except ValueError as error:
        raise InputError(f"not a readable XYZ file: {brief(error)}") from None
    return Cloud(rows.reshape(-1, 3), np.zeros((0, 3)))


READERS: dict[str, Callable[[Path], Cloud]] = {
    ".ply": _read_ply, ".pcd": read_pcd, ".xyz": _read_xyz,
}  # fmt: skip
