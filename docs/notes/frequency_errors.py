"""The estimated errors of frequencies of small solids against much finer solutions.

    python -m docs.notes.frequency_errors OUTPUT

Solids with re-entrant edges are made of the cells of a grid.  Their reference is the space
`optimal` on a grid that becomes small towards the planes of these edges.  The others are smooth;
their reference is all continuous functions on the same elements, each divided into eight.  Half of
the estimate of a reference is taken as its error.  The first six elastic frequencies are compared.

OUTPUT/table.md has a row per group and space for the solids of CHOSEN, on which the factors of the
estimate were chosen, and for the others.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.sparse import eye

from polycube.analysis.modal import free_modes
from polycube.analysis.problem import MATERIALS
from polycube.analysis.supports import prescribed, supports
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.named_sets import boundary_sets, sets_of_spline
from polycube.io.hex_meshes import boundary, patches
from polycube.registry import build
from polycube.spline.bezier import bezier_points
from polycube.types import HexMesh, Modes, Spline
from tests.fixtures import hexmeshes as made
from tests.plugins.test_spline_auto import strip

MODES = 12
SPACES = "optimal", "h2s"
NEAR = 1 / 64, 1 / 16, 1 / 4  # positions of the small elements in one that touches an edge
# lines of a grid and missing cells, and what is held
EDGED: dict[str, tuple[list[list[float]], set, tuple[str, ...]]] = {
    "L": ([[0, 1, 2], [0, 1], [0, 1, 2]], {(1, 0, 1)}, ()),
    "held L": ([[0, 1, 3], [0, 1.3], [0, 1, 3]], {(1, 0, 1)}, ("z_max",)),
    "slim L": ([[0, 1, 4], [0, 1.5], [0, 1, 3]], {(1, 0, 1)}, ()),
    "T": ([[0, 1.5, 2.5, 4], [0, 1.2], [0, 1, 3]], {(0, 0, 1), (2, 0, 1)}, ()),
    "U": ([[0, 1, 2.2, 3.2], [0, 1.4], [0, 1, 3]], {(1, 0, 1)}, ()),
    "corner": ([[0, 1, 2], [0, 1.1, 2.1], [0, 1.2, 2]], {(1, 1, 1)}, ()),
    "hole": ([[0, 1, 2, 3.2], [0, 1.1], [0, 1.1, 2, 3]], {(1, 0, 1)}, ()),
    "plus": (
        [[0, 1, 2.2, 3], [0, 0.8], [0, 1.1, 2, 3.3]],
        {(0, 0, 0), (2, 0, 0), (0, 0, 2), (2, 0, 2)},
        (),
    ),
    "pocket": ([[0, 1, 2.1, 3], [0, 0.9, 2, 3.1], [0, 0.8, 1.6]], {(1, 1, 1)}, ()),
    "slot": ([[0, 2], [0, 1, 1.5, 2.5], [0, 0.8, 1.5]], {(0, 1, 1)}, ()),
    "stair": ([[0, 1, 2, 3], [0, 1.3], [0, 0.7, 1.4, 2.1]], {(1, 0, 2), (2, 0, 1), (2, 0, 2)}, ()),
    "two slots": ([[0, 1, 2, 3, 4], [0, 1, 2.2], [0, 1, 1.8]], {(1, 0, 1), (3, 1, 1)}, ()),
}
SMOOTH: dict[str, tuple[Callable[[], HexMesh], tuple[str, ...]]] = {
    "ball": (made.hex_ball, ()),
    "barrel": (lambda: made.barrel((3, 3, 4), 0.3), ()),
    "beam": (lambda: made.hex_box((8, 2, 2), (10.0, 1.0, 1.0)), ()),
    "held beam": (lambda: made.hex_box((6, 2, 2), (6.0, 1.5, 1.0)), ("x_min",)),
    "block": (lambda: made.hex_box((6, 5, 4), (1.0, 0.9, 0.8)), ()),
    "box": (lambda: made.hex_box((4, 3, 3), (2.0, 1.5, 1.2)), ()),
    "cylinder": (lambda: made.hex_cylinder(2, 1, 4), ()),
    "pillowed 2": (lambda: made.pillowed_cube(2), ()),
    "pillowed 3": (made.pillowed_cube, ()),
    "plate": (lambda: made.hex_box((5, 4, 1), (5.0, 4.0, 0.6)), ()),
    "rings": (lambda: made.rings((2, 3, 4), 12, 2.0), ()),
    "held strip, 1": (lambda: strip(1), ("x_min",)),
    "strip, 1": (lambda: strip(1), ()),
    "held strip, 2": (lambda: strip(2), ("x_min",)),
    "thin, 5 x 5": (lambda: made.hex_box((5, 5, 1), (30.0, 30.0, 1.0)), ()),
    "thin, 9 x 6": (lambda: made.hex_box((9, 6, 1), (30.0, 20.0, 1.0)), ()),
    "tube": (lambda: made.rings((5, 5.6), 12, 6.0), ()),
}
CHOSEN = {"L", "slim L", "U", "hole", "pocket", "stair", "ball", "held beam", "cylinder"}
CHOSEN |= {"pillowed 3", "rings", "strip, 1"}


def grid(lines: list[list[float]], missing: set, parts: int, graded: bool = False) -> HexMesh:
    """The cells of a grid but the missing ones, each divided in every direction into parts."""
    keep = np.ones([len(line) - 1 for line in lines], bool)
    keep[tuple(np.transpose(list(missing)))] = False
    near = [set[int]() for _ in lines]
    for axis in range(3):
        cells = np.moveaxis(np.pad(keep, 1), axis, 0).astype(int)
        around = cells[:, :-1, :-1] + cells[:, 1:, :-1] + cells[:, :-1, 1:] + cells[:, 1:, 1:]
        for other, at in zip(
            np.delete(np.arange(3), axis), np.nonzero(around == 3)[1:], strict=True
        ):
            near[other] |= set(at.tolist())
    points, owner = [], []
    for line, planes in zip(lines, near, strict=True):
        found, own = [line[0]], []
        for i, (low, high) in enumerate(pairwise(line)):
            share = np.linspace(0, 1, parts + 1)
            small = np.array(NEAR) / parts if graded else np.zeros(0)
            for is_near, extra in ((i in planes, small), (i + 1 in planes, 1 - small)):
                share = np.union1d(share, extra if is_near else [])
            found += list(low + (high - low) * share[1:])
            own += [i] * (len(share) - 1)
        points.append(np.array(found))
        owner.append(own)
    gone = set(map(tuple, np.argwhere(~keep[np.ix_(*owner)]).tolist()))
    at, hexes = made.unit_cubes(*map(len, owner), tuple(gone))
    x, y, z = at.astype(int).T
    return hex_mesh(np.column_stack([points[0][x], points[1][y], points[2][z]]), hexes)


def spline_of(mesh: HexMesh, space: str, held: tuple[str, ...]) -> Spline:
    """A spline without fit, so that all spaces have the same solid, which is the part itself."""
    mesh = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh))
    mesh = replace(mesh, sets=boundary_sets(mesh))
    made_of = build("spline", {"plugin": space, "held": held, "fit": {"iterations": 0}})
    spline = made_of(boundary(mesh), mesh)
    return replace(spline, sets=sets_of_spline(spline, mesh), offset=np.zeros((0, 25)), tilt=[])


def divided(spline: Spline) -> Spline:
    """All continuous functions on the same elements, each divided into eight."""
    low = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8
    halves = low, low[::-1, ::-1]
    net = bezier_points(spline).reshape(-1, 4, 4, 4, 3)
    children = [(i, j, k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    parts = [
        np.einsum("ai,bj,ck,ekjid->ecbad", *(halves[side] for side in child), net)
        for child in children
    ]
    points = np.stack(parts, axis=1).reshape(-1, 3)
    _, first, nodes = np.unique(
        (np.pi * points / np.ptp(points)).round(8), axis=0, return_index=True, return_inverse=True
    )
    sides, faces = [], []
    for row, (element, face) in enumerate(spline.sides):
        own = [c for c, child in enumerate(children) if child[face // 2] == face % 2]
        sides += [(8 * element + c, face) for c in own]
        faces += [row] * 4
    rows = np.array(faces)
    return Spline(
        control=points[first],
        extraction=eye(len(first), format="csr"),
        nodes=nodes.reshape(-1, 64),
        element_hex=np.repeat(spline.element_hex, 8),
        level=np.zeros(8 * len(spline.nodes)),
        sides=np.array(sides),
        patch=np.zeros(len(sides)),
        sets={name: np.flatnonzero(np.isin(rows, own)) for name, own in spline.sets.items()},
    )


def modes(spline: Spline, held: tuple[str, ...]) -> Modes:
    """The modes of a steel part with their estimated errors."""
    given = supports(spline, prescribed(held))
    return free_modes(spline, MATERIALS["steel"], MODES, supports=given, enrich=True)


def ratios(found: Modes, exact: Modes) -> np.ndarray:
    """Estimated by true error of the first six elastic frequencies."""
    known = exact.frequency[exact.rigid :] * (1 - np.array(exact.errors) / 2)
    off = found.frequency[found.rigid :] / known - 1
    return (np.array(found.errors) / abs(off))[:6]


def main() -> None:
    """Solve all problems and write the table."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    rows: dict[tuple[str, str, str], list[np.ndarray]] = {}
    for name, (lines, missing, held) in EDGED.items():
        half = "chosen" if name in CHOSEN else "others"
        exact = modes(spline_of(grid(lines, missing, 3, graded=True), "optimal", held), held)
        for space in SPACES:
            for parts in (1, 2):
                found = modes(spline_of(grid(lines, missing, parts), space, held), held)
                rows.setdefault(("re-entrant", space, half), []).append(ratios(found, exact))
    for name, (mesh, held) in SMOOTH.items():
        half = "chosen" if name in CHOSEN else "others"
        splines = {space: spline_of(mesh(), space, held) for space in SPACES}
        exact = modes(divided(splines["optimal"]), held)
        for space, spline in splines.items():
            rows.setdefault(("smooth", space, half), []).append(ratios(modes(spline, held), exact))
    text = [
        "| solids | space | of them | problems | frequencies | within | estimate by error, median |"
    ]
    text.append("|---" * 7 + "|")
    for (group, space, half), each in sorted(rows.items()):
        ratio = np.concatenate(each)
        counts = f"{len(each)} | {len(ratio)} | {np.mean(ratio > 1):.1%} | {np.median(ratio):.1f}"
        text.append(f"| {group} | {space} | {half} | {counts} |")
    (folder / "table.md").write_text("\n".join(text) + "\n")


if __name__ == "__main__":
    main()
