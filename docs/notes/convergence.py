"""Convergence at extraordinary edges of real polycube meshes, with a manufactured solution.

    python docs/notes/convergence.py OUTPUT SIZE PART [PART ...]

A part is meshed automatically with few hexes of about SIZE diagonals.  On the solid of its spline
-laplace u = f is solved for u = cos(k.x + 1) sin(k'.x), with u given on the whole boundary; then
every element is divided into eight, and again.  The solid of `optimal` remains exactly the same;
that of `h2s` changes a little at extraordinary edges.  OUTPUT/PART.json holds the errors in the
norms of L2 and of the energy, and OUTPUT/table.md shows all of them.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import diags
from scipy.sparse.linalg import cg

import polycube
from polycube.analysis.assembly import Elements, assemble_scalar_lower
from polycube.analysis.constraints import Support, constrain
from polycube.analysis.recovery import jacobians, volumes
from polycube.registry import build
from polycube.spline.bernstein import gauss, volume_basis
from polycube.spline.bezier import bezier_points
from polycube.types import HexMesh, Spline, TriMesh

GAUSS = 5
LARGEST = 200_000  # functions
HALVINGS = 3
CHUNK = 256  # elements in a batch
FIRST, SECOND = np.array([2.0, -1.0, 1.5]), np.array([-1.0, 2.5, 2.0])  # waves, in diagonals


class Exact(NamedTuple):
    """The given solution on a part of a size."""

    diagonal: float

    def value(self, x: np.ndarray) -> np.ndarray:
        """(...) u of points (..., 3)."""
        a, b = (x @ wave / self.diagonal for wave in (FIRST, SECOND))
        return np.cos(a + 1) * np.sin(b)

    def slope(self, x: np.ndarray) -> np.ndarray:
        """(..., 3) grad u."""
        a, b = (x @ wave / self.diagonal for wave in (FIRST, SECOND))
        first, second = -np.sin(a + 1) * np.sin(b), np.cos(a + 1) * np.cos(b)
        return (first[..., None] * FIRST + second[..., None] * SECOND) / self.diagonal

    def source(self, x: np.ndarray) -> np.ndarray:
        """(...) -laplace u."""
        a, b = (x @ wave / self.diagonal for wave in (FIRST, SECOND))
        squares = FIRST @ FIRST + SECOND @ SECOND
        mixed = 2 * (FIRST @ SECOND) * np.sin(a + 1) * np.cos(b)
        return (squares * np.cos(a + 1) * np.sin(b) + mixed) / self.diagonal**2


def errors(spline: Spline, exact: Exact) -> tuple[float, float]:
    """Relative errors of u in L2 and of its gradient."""
    points, volume = bezier_points(spline), volumes(bezier_points(spline), GAUSS)
    values, gradients = volume_basis(gauss(GAUSS)[0])
    moments = (volume * exact.source(values @ points)) @ values
    on_nodes = np.bincount(spline.nodes.ravel(), moments.ravel(), spline.extraction.shape[0])
    everywhere = Support("all", np.arange(len(spline.sides)), (0,), exact.value)
    constraints = constrain(spline, [everywhere], 1)
    basis, offset = constraints.basis, constraints.offset
    stiffness = assemble_scalar_lower(Elements.of(spline), GAUSS)[0].full().tocsr()
    free = (basis.T @ stiffness @ basis).tocsr()
    right = basis.T @ (spline.extraction.T @ on_nodes - stiffness @ offset)
    near = diags(1 / free.diagonal())
    found, info = cg(free, right, rtol=1e-11, M=near, maxiter=20_000)
    assert info == 0
    local = (spline.extraction @ (basis @ found + offset))[spline.nodes][..., None]
    total = np.zeros(4)
    for own in np.array_split(np.arange(len(points)), len(points) // CHUNK + 1):
        x, weight = values @ points[own], volume[own]
        inverse = np.linalg.inv(jacobians(points[own], gradients))
        tilt = (jacobians(local[own], gradients) @ inverse)[:, :, 0]
        slope = exact.slope(x)
        off = (values @ local[own])[..., 0] - exact.value(x)
        square = off**2, exact.value(x) ** 2, ((tilt - slope) ** 2).sum(2), (slope**2).sum(2)
        total += [(weight * each).sum() for each in square]
    return float(np.sqrt(total[0] / total[1])), float(np.sqrt(total[2] / total[3]))


def convergence(surface: TriMesh, mesh: HexMesh) -> dict[str, list[list[float]]]:
    """Rows of functions and both errors, by space."""
    exact = Exact(float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))))
    found: dict[str, list[list[float]]] = {}
    for space in ("h2s", "optimal"):
        rows = found[space] = []
        for levels in range(HALVINGS + 1):
            if rows and 8 * rows[-1][0] > LARGEST:
                break
            options = {"plugin": space, "refine": {"levels": levels}}
            spline = build("spline", options)(surface, mesh)
            rows.append([len(spline.control), *errors(spline, exact)])
    return found


def table(found: dict[str, dict]) -> list[str]:
    """Lines of a table in Markdown."""
    lines = [
        "| part, extraordinary edges | space | functions | L2 | falls by | energy | falls by |"
    ]
    lines.append("|---" * 7 + "|")
    for part, of in found.items():
        for space, rows in of["spaces"].items():
            for i, (functions, *both) in enumerate(rows):
                cells = []
                for k, error in enumerate(both):
                    before = f"{rows[i - 1][1 + k] / error:.1f}" if i else ""
                    cells += [f"{error:.2g}", before]
                name = f"{part}, {of['extraordinary']}"
                lines.append(f"| {name} | `{space}` | {functions:,} | {' | '.join(cells)} |")
    return lines


def main() -> None:
    """Compute what is not there yet, then write the table."""
    output, size = Path(sys.argv[1]), sys.argv[2]
    output.mkdir(parents=True, exist_ok=True)
    found = {}
    for part in sys.argv[3:]:
        kept = output / f"{Path(part).stem.replace(':', '-')}.json"
        if not kept.exists():
            run = polycube.mesh(part, "order=[meshing,spline]", "spline=h2s", size=size)
            edges = run.spline.extraordinary_edges
            spaces = convergence(run.surface, run.hexes)
            kept.write_text(json.dumps({"extraordinary": edges, "spaces": spaces}))
        found[kept.stem] = json.loads(kept.read_text())
    (output / "table.md").write_text("\n".join(table(found)) + "\n")


if __name__ == "__main__":
    main()
