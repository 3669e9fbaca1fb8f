"""Bezier elements and solutions for ParaView: cells of type VTK_BEZIER_HEXAHEDRON, degree 3."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from polycube.io.atomic import atomic_write
from polycube.io.vtk import HEXAHEDRON, write_cells
from polycube.types import Deformation, Modes, Solution, Spline

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

BEZIER_HEXAHEDRON = 79  # VTK's number for the cell


def _vtk_order() -> np.ndarray:
    """(64,) place i + 4 j + 16 k of each of VTK's points: corners, edges, faces, body."""
    corner = [(0, 0), (3, 0), (3, 3), (0, 3)]
    inner = (1, 2)
    points = [(i, j, k) for k in (0, 3) for i, j in corner]
    for k in (0, 3):
        points += [(i, 0, k) for i in inner] + [(3, j, k) for j in inner]
        points += [(i, 3, k) for i in inner] + [(0, j, k) for j in inner]
    points += [(i, j, k) for i, j in corner for k in inner]
    points += [(i, j, k) for i in (0, 3) for k in inner for j in inner]
    points += [(i, j, k) for j in (0, 3) for k in inner for i in inner]
    points += [(i, j, k) for k in (0, 3) for j in inner for i in inner]
    points += [(i, j, k) for k in inner for j in inner for i in inner]
    return np.array(points) @ [1, 4, 16]


VTK_ORDER = _vtk_order()


def write_bezier_vtu(
    path: Path,
    spline: Spline,
    point_data: Mapping[str, np.ndarray] | None = None,
    bezier_data: Mapping[str, np.ndarray] | None = None,
    cell_data: Mapping[str, np.ndarray] | None = None,
    precision: str = "double",
) -> Path:
    """Write the Bezier elements, with the hex each came from.

    point_data : coefficients at the control points, (C,) or (C, n), of fields on the spline
    bezier_data : Bezier coefficients of other fields, (B,) or (B, n)
    cell_data : numbers of the elements, (E,) or (E, n)
    precision : "single" or "double", of the fields; points are double
    """
    fields = _fields(spline.extraction, point_data, bezier_data, precision)
    return write_cells(
        path,
        spline.extraction @ spline.control,
        spline.nodes[:, VTK_ORDER],
        BEZIER_HEXAHEDRON,
        fields,
        {"hex": spline.element_hex, **(cell_data or {})},
    )


def write_corner_vtu(
    path: Path,
    spline: Spline,
    point_data: Mapping[str, np.ndarray] | None = None,
    bezier_data: Mapping[str, np.ndarray] | None = None,
    precision: str = "double",
) -> Path:
    """Write hexahedra of eight nodes, the corners of the elements, and the fields there.

    Arguments are those of `write_bezier_vtu`.  The Bezier coefficients at the corners of an element
    are values of the field.
    """
    used, cells = np.unique(spline.nodes[:, VTK_ORDER[:8]], return_inverse=True)
    at_corners = {name: array[used] for name, array in (bezier_data or {}).items()}
    return write_cells(
        path,
        spline.extraction[used] @ spline.control,
        cells.reshape(-1, 8),
        HEXAHEDRON,
        _fields(spline.extraction[used], point_data, at_corners, precision),
        {"hex": spline.element_hex},
    )


def _fields(
    extraction: csr_matrix,
    point_data: Mapping[str, np.ndarray] | None,
    bezier_data: Mapping[str, np.ndarray] | None,
    precision: str,
) -> dict[str, np.ndarray]:
    """Fields at the Bezier nodes that the rows of `extraction` belong to."""
    fields = {name: extraction @ array for name, array in (point_data or {}).items()}
    kind = {"single": np.float32, "double": np.float64}[precision]
    return {name: array.astype(kind) for name, array in {**fields, **(bezier_data or {})}.items()}


def write_solution(
    folder: Path,
    spline: Spline,
    solution: Solution,
    has_bezier: bool = True,
    precision: str = "double",
) -> None:
    """Write the files of a solution: modes.csv and modes.vtu, static.vtu, or poisson.vtu.

    has_bezier : the cells are Bezier elements; otherwise hexahedra of eight nodes
    precision : "single" or "double", of the fields
    """
    at_nodes: dict[str, np.ndarray] = {}
    if isinstance(solution, Modes):
        write_modes_csv(folder / "modes.csv", solution)
        name, at_control = "modes.vtu", scaled_shapes(spline, solution)
    elif isinstance(solution, Deformation):
        name, at_control = "static.vtu", {"displacement": solution.displacement}
        at_nodes = {"stress": solution.stress, "von_mises": solution.von_mises}
    else:
        name, at_control = "poisson.vtu", {"u": solution.values}
        at_nodes = {"flux": solution.flux}
    write = write_bezier_vtu if has_bezier else write_corner_vtu
    write(folder / name, spline, at_control, at_nodes, precision=precision)


def scaled_shapes(spline: Spline, modes: Modes) -> dict[str, np.ndarray]:
    """The displacements (C, 3) of the modes by name, "mode_07 1.234e+03 Hz".

    Each is scaled to a largest displacement of a tenth of the control points' diagonal.
    """
    size = 0.1 * np.linalg.norm(np.ptp(spline.control, axis=0))
    unit = modes.units.get("frequency", "")
    return {
        f"mode_{k:02d} {frequency:.4g} {unit}".rstrip(): shape
        * (size / np.linalg.norm(shape, axis=1).max())
        for k, (frequency, shape) in enumerate(
            zip(modes.frequency, modes.shapes, strict=True), start=1
        )
    }


def write_modes_csv(path: Path, modes: Modes) -> Path:
    """Write one line per mode: number from 1, omega^2 and frequency."""
    lines = ["mode,omega_squared,frequency_hz"]
    lines += [
        f"{k},{value:.17g},{frequency:.17g}"
        for k, (value, frequency) in enumerate(
            zip(modes.eigenvalues.tolist(), modes.frequency.tolist(), strict=True), start=1
        )
    ]
    with atomic_write(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n")
    return Path(path)
