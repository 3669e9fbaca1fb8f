"""A small finished run: a cube and a cube with a hole, bent, with spline and modes; and a bar."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import identity

from polycube.hexmesh.connectivity import hex_mesh, quad_sides
from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build
from polycube.report.page.html import write_report
from polycube.report.pictures.pictures import pictures
from polycube.state import RunState
from polycube.structure.lattice import boundary, cell_of_box, lattice
from polycube.types import Deformation, HexMesh, Json, Labels, Modes, Polycube, Spline, TriMesh
from tests.fixtures.hexmeshes import CORNERS
from tests.fixtures.splines import BAR, box


def bend(points: np.ndarray) -> np.ndarray:
    """Points of the polycube in the model, 100 units long and bent."""
    x, y, z = points.T
    return 50 * np.stack([x, y + 0.15 * (x - 1) ** 2, z * (1 + 0.2 * x)], 1)


def polycube_of_run() -> Polycube:
    hole = np.ones((3, 3, 3), bool)
    hole[1, 1] = False
    return lattice((2, 1, 1), ("cube", "hole_z"), {"cube": np.ones_like(hole), "hole_z": hole})


def hexes_of(polycube: Polycube) -> HexMesh:
    """One hex per box, with the polycube's patches."""
    boxes = np.argwhere(polycube.occupancy)
    shape = np.array(polycube.occupancy.shape) + 1
    corners = np.ravel_multi_index((boxes[:, None] + CORNERS).reshape(-1, 3).T, shape)
    used, hexes = np.unique(corners, return_inverse=True)
    index = np.unravel_index(used, shape)
    points = np.stack([knots[i] for knots, i in zip(polycube.knots, index, strict=True)], 1)
    faces = boundary(polycube)
    number = {tuple(point): i for i, point in enumerate(points.tolist())}
    where = np.array([number[tuple(point)] for point in faces.vertices.tolist()])
    cell = cell_of_box(polycube)
    return hex_mesh(bend(points), hexes.reshape(-1, 8), where[faces.quads], faces.patch, cell)


def spline_of(mesh: HexMesh) -> Spline:
    """Every hex as a Bezier element, C0: its trilinear map, raised to degree three."""
    t = np.arange(4) / 3
    k, j, i = np.meshgrid(t, t, t, indexing="ij")
    local = np.stack([i, j, k], -1).reshape(-1, 1, 3)
    weights = np.where(CORNERS, local, 1 - local).prod(-1)  # (64, 8)
    points = np.einsum("pc,hcx->hpx", weights, mesh.vertices[mesh.hexes]).reshape(-1, 3)
    _, first, nodes = np.unique(points.round(6), axis=0, return_index=True, return_inverse=True)
    number = np.arange(len(mesh.hexes))
    return Spline(
        points[first],
        identity(len(first), format="csr"),
        nodes.reshape(-1, 64),
        number,
        0 * number,
        np.stack(quad_sides(mesh), axis=1),
        mesh.patch,
    )


@pytest.fixture(scope="session")
def run() -> RunState:
    """State of a finished run."""
    polycube = polycube_of_run()
    faces = boundary(polycube)
    triangles = faces.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    surface = TriMesh(bend(faces.vertices), triangles)
    labels = Labels(np.repeat(faces.axis, 2), np.repeat(faces.patch, 2))
    hexes = hexes_of(polycube)
    hexes = replace(hexes, sets=boundary_sets(hexes))
    spline = spline_of(hexes)
    x, y, z = (spline.control - spline.control.mean(0)).T
    flat = np.zeros_like(x)
    shapes = [np.eye(3)[i] + 0 * spline.control for i in range(3)]
    shapes += [np.stack(c, 1) for c in ([flat, -z, y], [z, flat, -x], [-y, x, flat])]
    shapes += [np.stack([flat, flat, x**2], 1), np.stack([flat, -z * x, y * x], 1)]
    values = [-1e-9, 0, 1e-9, 2e-9, 2e-9, 3e-9, 1.6e5, 6.4e5]
    units = {"length": "mm", "mass": "kg", "time": "s", "frequency": "Hz"}
    noise = np.random.default_rng(0).normal(size=(5, 512, 3))
    line = np.linspace(0, 1, 512)[:, None] * [2.0, 1.0, 1.0]
    return RunState(
        surface,
        polycube=polycube,
        labels=labels,
        hexes=hexes,
        spline=spline,
        solution=Modes(np.array(values), np.array(shapes), 1.5, units),
        trajectory=line + noise * np.linspace(0.3, 0, 5)[:, None, None],
        steps=(500, 499, 479, 19, 0),
    )


@pytest.fixture(scope="session")
def drawn(run: RunState) -> dict[str, bytes]:
    """Pictures of the run, drawn once for all tests."""
    pytest.importorskip("pyvista")
    return pictures(run)


@pytest.fixture(scope="session")
def written() -> Callable[[Path, RunState, Json, dict[str, bytes]], Path]:
    """A function that writes the report of a run with given pictures, as if they were drawn."""

    def write(folder: Path, state: RunState, report: Json, images: dict[str, bytes]) -> Path:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("polycube.report.page.html.pictures", lambda *_: images)
            return write_report(folder, state, report)

    return write


@pytest.fixture(scope="session")
def bar() -> Spline:
    """A straight bar."""
    return box((4, 1, 1), BAR)


@pytest.fixture(scope="session")
def pulled(bar: Spline) -> Deformation:
    """The bar, 1 % longer along x and free to contract."""
    held = [{"at": f"{axis}_min", "components": [axis]} for axis in "xyz"]
    pull = {"at": "x_max", "components": ["x"], "value": 0.04}
    problem = {"plugin": "static", "fixed": [*held, pull], "gravity": [0, 0, 0]}
    return build("analysis", problem)(bar)
