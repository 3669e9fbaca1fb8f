"""Input surface and results of the analysis as data of the 3D view."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from polycube.report.numbers.formatting import frequency, text
from polycube.report.pictures.colours import DISPLACEMENT_COLOURS, FIELD_COLOURS, rgb
from polycube.report.pictures.fields import N_MODES, TINY, exaggeration, first_elastic
from polycube.types import Deformation, Json, Modes, Solution, Spline, TriMesh

MOST_TRIANGLES = 40_000  # of the input surface in the page
MOST_VALUES = 120_000  # vertices times results in the page
CORNERS = [0, 3, 12, 15, 48, 51, 60, 63]  # of the 64 nodes of a Bezier element
PASCAL = 1e6  # in a MPa
STEPS = 32767  # from 0 to the largest displacement, as int16; values have twice as many, as uint16


@dataclass(frozen=True, eq=False)
class Result:
    """A result at points of the mesh."""

    title: str  # name of the values
    unit: str  # their unit
    values: np.ndarray  # (N,) values
    ends: tuple[float, float]  # values at the ends of the colour bar
    colours: tuple[str, ...]  # of the colour bar
    labels: tuple[str, str]  # text at the ends of the colour bar
    # (N, 3) displacement, with the largest one as long as 1; None: the part is at rest
    shift: np.ndarray | None = None
    drawn: str = ""  # sentence about the exaggeration of the displacement

    def numbers(self) -> Json:
        """What the script of the view needs to know."""
        own = {name: getattr(self, name) for name in ("title", "unit", "ends", "drawn")}
        return {**own, "stops": rgb(self.colours).tolist(), "moves": self.shift is not None}

    def arrays(self) -> list[np.ndarray]:
        """Values in steps of the colour bar, and displacements in steps of the largest one."""
        low, high = self.ends
        share = ((self.values - low) / max(high - low, TINY)).clip(0, 1)
        found = [(2 * STEPS * share).round().astype("<u2")]
        if self.shift is not None:
            found.append((STEPS * self.shift).round().astype("<i2"))
        return found


def results(spline: Spline, solution: Solution, points: np.ndarray, unit: str) -> list[Result]:
    """Results at points (N, 3) of the mesh: values at the nearest corners of the elements.

    As many as `MOST_VALUES` allows, and at least one.
    """
    nodes = spline.extraction @ spline.control
    corners = np.unique(spline.nodes[:, CORNERS])
    nearest = corners[cKDTree(nodes[corners]).query(points)[1]]
    at = spline.extraction[nearest]
    if isinstance(solution, Modes):
        found = [*_modes(solution, at)]
    elif isinstance(solution, Deformation):
        found = _static(solution, nearest, nodes, unit)
    else:
        u = at @ solution.values
        ends = float(u.min()), float(u.max())
        name = solution.units.get("u", "")
        labels = (f"{text(ends[0])} {name}", f"{text(ends[1])} {name}")
        found = [Result("u", name, u, ends, FIELD_COLOURS, labels)]
    return found[: max(1, MOST_VALUES // len(points))]


def _modes(modes: Modes, at: csr_matrix) -> Iterator[Result]:
    first, unit = first_elastic(modes), modes.units.get("frequency", "")
    for number in range(first, min(first + N_MODES, len(modes.eigenvalues))):
        shift = _scaled(at @ modes.shapes[number])
        title = f"mode {number + 1}: {frequency(float(modes.frequency[number]), unit)}"
        values, labels = np.linalg.norm(shift, axis=1), ("at rest", "largest displacement")
        yield Result(title, "", values, (0, 1), DISPLACEMENT_COLOURS, labels, shift)


def _static(found: Deformation, nodes: np.ndarray, points: np.ndarray, unit: str) -> list[Result]:
    moved = found.displacement[nodes]
    length = np.linalg.norm(moved, axis=1)
    stress = found.von_mises[nodes] / PASCAL
    most = found.peak.value / PASCAL if found.peak else float(stress.max())
    times = exaggeration(points, length.max())
    drawn = f"displacement drawn {text(float(f'{times:.3g}'))} times as large"
    shift = _scaled(moved)
    ends = 0.0, float(length.max())
    of_length = length, ends, DISPLACEMENT_COLOURS, ("0", f"{text(ends[1])} {unit}")
    of_stress = stress, (0.0, most), FIELD_COLOURS, ("0", f"{text(most)} MPa and more")
    displaced = Result("displacement", unit, *of_length, shift, drawn)
    return [displaced, Result("von Mises stress", "MPa", *of_stress, shift, drawn)]


def _scaled(shift: np.ndarray) -> np.ndarray:
    return np.asarray(shift / max(np.linalg.norm(shift, axis=1).max(), TINY))


def simplified(surface: TriMesh, most: int = MOST_TRIANGLES) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (S, 3) and at most `most` triangles (T, 3) close to the surface.

    Vertices in one cell of a grid are joined to their mean, and the cells are enlarged until there
    are few enough triangles left.
    """
    vertices, faces = surface.vertices, surface.faces
    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0).max()
    n_cells = 512
    while len(faces) > most:
        cells = ((surface.vertices - low) / size * n_cells).astype(np.int64)
        _, joined = np.unique(cells, axis=0, return_inverse=True)
        joined = joined.ravel()
        count = np.bincount(joined)
        sums = [np.bincount(joined, column) / count for column in surface.vertices.T]
        vertices, faces = np.stack(sums, axis=1), joined[surface.faces]
        faces = np.unique(faces[~(faces == np.roll(faces, 1, axis=1)).any(axis=1)], axis=0)
        n_cells = n_cells * 3 // 4
    return vertices, faces
