"""Exodus II."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.io.atomic import atomic_write
from polycube.registry import register
from polycube.types import HexMesh

from .format import WithNodes
from .groups import blocks, node_sets, renamed, side_sets

if TYPE_CHECKING:
    from scipy.io import netcdf_file, netcdf_variable

    from polycube.spline.second_order import HexElements

SIDES = np.array([4, 2, 1, 3, 5, 6])  # numbers of the faces -xi +xi -eta +eta -zeta +zeta in Exodus
# order of the nodes in Exodus: edges along zeta before the upper ones, the centre before faces
ORDER = np.array([*range(12), *range(16, 20), *range(12, 16), 26, 24, 25, 20, 21, 22, 23])
NAME = 256  # longest name, including the terminating zero


@register("export", "exodus")
@dataclass(frozen=True)
class Exodus(WithNodes):
    """Exodus II (.exo): a block for each grid cell, named sets of nodes and sides.

    The container is netCDF with 64-bit offsets. Primitives are in the names of the blocks, because
    VTK does not read element sets.
    """

    suffix: ClassVar[str] = ".exo"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
        from scipy.io import netcdf_file

        own = self.elements(hexes)
        hexes = renamed(hexes, NAME - 1, ascii_only=False)
        path = path.with_suffix(self.suffix)
        with atomic_write(path) as temporary, netcdf_file(str(temporary), "w", version=2) as file:
            _head(file, hexes.unit or "the units of the input")
            for axis, points in zip("xyz", own.points.T, strict=True):
                _array(file, f"coord{axis}", points, "num_nodes")
            _names(file, "coor_names", list("xyz"), "num_dim")
            _elements(file, hexes, own.hexes[:, ORDER[: self.nodes]])
            _sets(file, hexes, own)
        return path


def _head(file: netcdf_file, unit: str) -> None:
    file.api_version = file.version = np.float32(5.1)
    file.floating_point_word_size, file.file_size = np.int32(8), np.int32(1)
    file.maximum_name_length = np.int32(NAME - 1)
    file.title = f"hex mesh of polycube, lengths in {unit}"
    file.createDimension("time_step", None)
    for name, size in {"len_string": 33, "len_name": NAME, "len_line": 81, "four": 4}.items():
        file.createDimension(name, size)
    file.createVariable("time_whole", "d", ("time_step",))


def _elements(file: netcdf_file, mesh: HexMesh, hexes: np.ndarray) -> None:
    """A block per grid cell; `elem_num_map` has the numbers of the hexes in the mesh, from one."""
    own = blocks(mesh)
    _listed(file, "eb", list(own), "num_el_blk")
    for k, rows in enumerate(own.values(), start=1):
        sizes = (f"num_el_in_blk{k}", f"num_nod_per_el{k}")
        connect = _array(file, f"connect{k}", hexes[rows] + 1, *sizes)
        connect.elem_type = f"HEX{hexes.shape[1]}"
    _array(file, "elem_num_map", np.concatenate([*own.values()]) + 1, "num_elem")


def _sets(file: netcdf_file, mesh: HexMesh, elements: HexElements) -> None:
    """Element numbers in sets are positions in the order of the blocks."""
    place = np.argsort(np.concatenate([*blocks(mesh).values()]))
    from polycube.hexmesh.connectivity import quad_sides

    owner, side = quad_sides(mesh)
    nodes, sides = node_sets(mesh, elements.quads), side_sets(mesh)
    _listed(file, "ns", list(nodes), "num_node_sets")
    for k, own in enumerate(nodes.values(), start=1):
        _array(file, f"node_ns{k}", own + 1, f"num_nod_ns{k}")
    _listed(file, "ss", list(sides), "num_side_sets")
    for k, own in enumerate(sides.values(), start=1):
        _array(file, f"elem_ss{k}", place[owner[own]] + 1, f"num_side_ss{k}")
        _array(file, f"side_ss{k}", SIDES[side[own]], f"num_side_ss{k}")


def _listed(file: netcdf_file, kind: str, names: list[str], size: str) -> None:
    """Status, number and name of each block or set of a kind."""
    _array(file, f"{kind}_status", np.ones(len(names), np.int32), size)
    _array(file, f"{kind}_prop1", np.arange(1, len(names) + 1), size).name = "ID"
    _names(file, f"{kind}_names", names, size)


def _names(file: netcdf_file, variable: str, names: list[str], size: str) -> None:
    rows = [list(name.encode()[: NAME - 1].ljust(NAME, b"\0")) for name in names]
    text = np.reshape(rows, (-1, NAME)).astype(np.uint8).view("c")
    _array(file, variable, text, size, "len_name")


def _array(file: netcdf_file, name: str, values: np.ndarray, *sizes: str) -> netcdf_variable:
    """Write an array, and its dimensions unless they exist."""
    for size, length in zip(sizes, values.shape, strict=True):
        if size not in file.dimensions:
            file.createDimension(size, length)
    kind = {"f": "d", "S": "c"}.get(values.dtype.kind, "i")
    variable = file.createVariable(name, kind, sizes)
    variable[:] = values
    return variable
