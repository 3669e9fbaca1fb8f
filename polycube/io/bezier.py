"""Splines as Bezier cells of VTK, and the fields of solutions as values at points."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from polycube.analysis.recovery import samples
from polycube.io.atomic import atomic_write
from polycube.io.vtk import BEZIER_HEXAHEDRON, HEXAHEDRON, LAGRANGE_HEXAHEDRON, write_cells
from polycube.types import Deformation, Modes, Solution, Spline


@cache
def vtk_order() -> np.ndarray:
    """(64,) index i + 4 j + 16 k of each of VTK's points: corners, edges, faces, body."""
    from vtkmodules.vtkCommonDataModel import vtkHigherOrderHexahedron

    number = vtkHigherOrderHexahedron.PointIndexFromIJK
    return np.argsort([number(i, j, k, [3, 3, 3, 64]) for k, j, i in np.ndindex(4, 4, 4)])


def write_bezier_vtu(
    path: Path, spline: Spline, cell_data: Mapping[str, np.ndarray] | None = None
) -> Path:
    """Write the Bezier elements with the hex of each element.

    cell_data : data of the elements, (E,) or (E, n)
    """
    points, cells = spline.extraction @ spline.control, spline.nodes[:, vtk_order()]
    of_cells = {"hex": spline.element_hex, **(cell_data or {})}
    return write_cells(path, points, cells, BEZIER_HEXAHEDRON, {}, of_cells)


def write_field_vtu(
    path: Path,
    spline: Spline,
    fields: Mapping[str, np.ndarray],
    is_curved: bool = True,
    precision: str = "double",
) -> Path:
    """Write fields as values at points of the elements, with the hex of each element.

    fields : Bezier coefficients, (B,) or (B, n)
    is_curved : True: cells are cubic Lagrange hexahedra with 4^3 evenly spaced points; False:
        hexahedra of eight nodes, the corners of the elements
    precision : "single" or "double", for the fields; points are double
    """
    places = vtk_order().copy() if is_curved else vtk_order()[:8]
    if is_curved:  # of Lagrange cells in files of version 1.0: two edges are exchanged
        places[28:32] = places[[30, 31, 28, 29]]
    _, first, cells = np.unique(spline.nodes[:, places], return_index=True, return_inverse=True)

    def values(coefficients: np.ndarray) -> np.ndarray:
        each = samples(spline, coefficients.reshape(len(coefficients), -1))[:, places]
        return each.reshape(-1, each.shape[2])[first].reshape(-1, *coefficients.shape[1:])

    return write_cells(
        path,
        values(spline.extraction @ spline.control),
        cells.reshape(-1, len(places)),
        LAGRANGE_HEXAHEDRON if is_curved else HEXAHEDRON,
        {name: values(coefficients).astype(precision) for name, coefficients in fields.items()},
        {"hex": spline.element_hex},
    )


def write_solution(
    folder: Path,
    spline: Spline,
    solution: Solution,
    is_curved: bool = True,
    precision: str = "double",
) -> None:
    """Write the files of a solution: modes.csv and modes.vtu, static.vtu, or poisson.vtu.

    is_curved, precision : see `write_field_vtu`
    """
    if isinstance(solution, Modes):
        write_modes_csv(folder / "modes.csv", solution)
        shapes = scaled_shapes(spline, solution).items()
        name, fields = "modes.vtu", {key: spline.extraction @ shape for key, shape in shapes}
    elif isinstance(solution, Deformation):
        names = ("displacement", "stress", "von_mises")
        name, fields = "static.vtu", {each: getattr(solution, each) for each in names}
    else:
        name, fields = "poisson.vtu", {"u": spline.extraction @ solution.values}
        fields["flux"] = solution.flux
    write_field_vtu(folder / name, spline, fields, is_curved, precision)


def scaled_shapes(spline: Spline, modes: Modes) -> dict[str, np.ndarray]:
    """The displacements (C, 3) of the modes by name, such as "mode_07 1.234e+03 Hz".

    Each is scaled to a largest displacement of a tenth of the diagonal of the control points.
    """
    size = 0.1 * np.linalg.norm(np.ptp(spline.control, axis=0))
    unit = modes.units.get("frequency", "")
    found = {}
    for k, shape in enumerate(modes.shapes):
        name = f"mode_{k + 1:02d} {modes.frequency[k]:.4g} {unit}".rstrip()
        found[name] = shape * (size / np.linalg.norm(shape, axis=1).max())
    return found


def write_modes_csv(path: Path, modes: Modes) -> Path:
    """Write one line per mode: number from 1, omega^2 and frequency."""
    numbers = np.arange(1, len(modes.eigenvalues) + 1)
    rows = np.column_stack([numbers, modes.eigenvalues, modes.frequency])
    head = "mode,omega_squared,frequency_hz"
    with atomic_write(path) as temporary:
        np.savetxt(temporary, rows, ["%d", "%.17g", "%.17g"], ",", header=head, comments="")
    return Path(path)
