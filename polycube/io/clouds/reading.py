"""Read the points of a scan, with normals if the file contains them.

trimesh reads PLY and numpy reads XYZ. open3d reads all of these formats, but it returns the
readable part of a damaged file without an error.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief
from polycube.io.clouds.pcd import read_pcd
from polycube.surface.clouds.points import Cloud

NORMAL = ("nx", "ny", "nz")
HEADER = 100_000  # largest size of the header of a PLY file, in bytes


def is_cloud(path: Path) -> bool:
    """Whether a file contains points only; decided by its suffix and, for PLY, by its header."""
    suffix = path.suffix.lower()
    if suffix == ".ply" and path.is_file():
        with path.open("rb") as file:
            header = [
                line.split() for line in file.read(HEADER).split(b"end_header")[0].split(b"\n")
            ]
        number = {
            line[1]: line[2] for line in header if line[:1] == [b"element"] and len(line) == 3
        }
        return b"vertex" in number and number.get(b"face", b"0") == b"0"
    return suffix in READERS and not path.is_dir()


def read_cloud(path: Path) -> Cloud:
    """Points of a file, unchanged.

    Raises
    ------
    InputError
        If the file is empty, damaged or of an unknown kind.
    """
    if not path.read_bytes():
        raise InputError("the file is empty")
    return READERS[path.suffix.lower()](path)


def _read_ply(path: Path) -> Cloud:
    from trimesh import PointCloud, load

    try:
        cloud = load(path, process=False)
        if not isinstance(cloud, PointCloud):
            raise ValueError("it has no points")
        rows = cloud.metadata["_ply_raw"]["vertex"]["data"]  # record array; dict for text files
        points = np.array(cloud.vertices, dtype=np.float64)
        known = set(rows if isinstance(rows, dict) else rows.dtype.names)
        normals = [np.ravel(rows[name]) for name in NORMAL] if known.issuperset(NORMAL) else []
    except Exception as error:  # trimesh raises many kinds of exceptions
        raise InputError(f"not a readable PLY file: {brief(error)}") from error
    return Cloud(points, np.array(normals).T.reshape(-1, 3))


def _read_xyz(path: Path) -> Cloud:
    text = path.read_text(encoding="latin-1").replace(",", " ")
    try:
        rows = np.loadtxt(text.splitlines(), ndmin=2, usecols=(0, 1, 2))
    except ValueError as error:
        raise InputError(f"not a readable XYZ file: {brief(error)}") from None
    return Cloud(rows.reshape(-1, 3), np.zeros((0, 3)))


READERS: dict[str, Callable[[Path], Cloud]] = {
    ".ply": _read_ply,
    ".pcd": read_pcd,
    ".xyz": _read_xyz,
}
