"""Bezier elements and solutions for ParaView: cells of type VTK_BEZIER_HEXAHEDRON, degree 3."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from polycube.io.atomic import atomic_write
from polycube.io.vtk import write_cells
from polycube.types import Deformation, Modes, Potential, Solution, Spline

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
) -> Path:
    """Write the Bezier elements, with the hex each came from.

    point_data : coefficients at the control points, (C,) or (C, n), of fields on the spline
    bezier_data : Bezier coefficients of other fields, (B,) or (B, n)
    cell_data : numbers of the elements, (E,) or (E, n)
    """
    fields = {name: spline.extraction @ array for name, array in (point_data or {}).items()}
    fields |= bezier_data or {}
    return write_cells(
        path,
        spline.extraction @ spline.control,
        spline.nodes[:, VTK_ORDER],
        BEZIER_HEXAHEDRON,
        fields,
        {"hex": spline.element_hex, **(cell_data or {})},
    )


def write_solution(folder: Path, spline: Spline, solution: Solution) -> None:
    """Write the files of a solution: modes.csv and modes.vtu, static.vtu, or poisson.vtu."""
    if isinstance(solution, Modes):
        write_modes_csv(folder / "modes.csv", solution)
        write_modes_vtu(folder / "modes.vtu", spline, solution)
    elif isinstance(solution, Deformation):
        stress = {"stress": solution.stress, "von_mises": solution.von_mises}
        moved = {"displacement": solution.displacement}
        write_bezier_vtu(folder / "static.vtu", spline, moved, stress)
    elif isinstance(solution, Potential):
        flux = {"flux": solution.flux}
        write_bezier_vtu(folder / "poisson.vtu", spline, {"u": solution.values}, flux)


def write_modes_vtu(path: Path, spline: Spline, modes: Modes) -> Path:
    """Write the Bezier elements with one displacement field per mode, "mode_07 1.234e+03 Hz".

    Each is scaled to a largest displacement of a tenth of the control points' diagonal.
    """
    size = 0.1 * np.linalg.norm(np.ptp(spline.control, axis=0))
    unit = modes.units.get("frequency", "")
    fields = {
        f"mode_{k:02d} {frequency:.4g} {unit}".rstrip(): shape
        * (size / np.linalg.norm(shape, axis=1).max())
        for k, (frequency, shape) in enumerate(
            zip(modes.frequency, modes.shapes, strict=True), start=1
        )
    }
    return write_bezier_vtu(path, spline, fields)


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
