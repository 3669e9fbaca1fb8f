"""The estimated error of the largest stress, on twenty curved solids of one block.

    python docs/notes/stresses.py OUTPUT

The solids are rings, hooks, notches, necks, plates with a hole, bent and twisted bars.  Each has a
few elements of all continuous tricubic functions, and then 1.5 times as many along two or three of
their directions.  The reference has every element divided into eight, on the same solid.  OUTPUT is
a table in Markdown: the true error of the largest stress, its estimate and that of the reference.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import eye

from polycube.analysis.recovery import TO_BEZIER
from polycube.registry import build
from polycube.spline.bernstein import bernstein
from polycube.types import Deformation, Spline

Counts = tuple[int, int, int]
Map = Callable[[np.ndarray], np.ndarray]  # of points of the unit cube (..., 3) to the solid
FINER = 1.5  # times as many elements
PLACES = np.indices((4, 4, 4)).T.reshape(-1, 3)  # Bezier nodes of an element, i first
U_MIN, U_MAX, V_MIN, V_MAX, W_MIN, _ = (f"patch_{side}" for side in range(6))
Part = tuple[Counts, Map, Any, Any]  # elements, map, supports, loads


def solid(counts: Counts, place: Map) -> Spline:
    """Tricubic elements through 4^3 even points each; patches are numbered -u +u -v +v -w +w."""
    first = np.stack(np.meshgrid(*map(range, counts), indexing="ij"), -1).reshape(-1, 3)
    at = 3 * first[:, None] + PLACES
    size = 3 * np.array(counts) + 1
    nodes = np.ravel_multi_index(tuple(np.moveaxis(at, 2, 0)), tuple(size))
    control = np.zeros((size.prod(), 3))
    control[nodes] = TO_BEZIER @ place(at / (size - 1))
    sides = [
        (element, side)
        for element, own in enumerate(first)
        for side in range(6)
        if own[side // 2] == (side % 2) * (counts[side // 2] - 1)
    ]
    rows = np.array(sides)
    spline = Spline(
        control,
        eye(len(control), format="csr"),
        nodes,
        np.arange(len(nodes)),
        np.zeros(len(nodes), np.int64),
        rows,
        rows[:, 1],
    )
    return replace(spline, sets={f"patch_{k}": np.flatnonzero(rows[:, 1] == k) for k in range(6)})


def on_elements(spline: Spline, counts: Counts, at: np.ndarray) -> np.ndarray:
    """Points of a solid (E, 64, 3), all 64 inside one of its elements, by their places."""
    place = at * counts
    own = np.floor(place.mean(axis=1)).astype(int)
    points = spline.control[spline.nodes][np.ravel_multi_index(tuple(own.T), counts)]
    u, v, w = (
        bernstein(each.ravel()).reshape(*each.shape, 4)
        for each in np.moveaxis(place - own[:, None], 2, 0)
    )
    each = points.reshape(-1, 4, 4, 4, 3)
    return np.asarray(np.einsum("eqa,eqb,eqc,ecbad->eqd", u, v, w, each, optimize=True))


def ring(inner: float, outer: float, turn: float, height: float) -> Map:
    """A ring through an angle."""

    def place(at: np.ndarray) -> np.ndarray:
        angle, radius = turn * (1 - at[..., 0]), inner + (outer - inner) * at[..., 1]
        along = radius * np.cos(angle), radius * np.sin(angle)
        return np.stack([*along, height * at[..., 2]], axis=-1)

    return place


def notched(high: float, deep: float, wide: float, sides: int = 1) -> Map:
    """A bar of length 6 and width 1 with a smooth notch on top, or on two sides."""

    def place(at: np.ndarray) -> np.ndarray:
        x = 6 * at[..., 0] - 3
        left = high - sides * deep * np.exp(-((x / wide) ** 2))
        return np.stack([x, at[..., 1], (at[..., 2] - (sides - 1) / 2) * left], axis=-1)

    return place


def drilled(radius: float, half: float, thick: float) -> Map:
    """A quarter of a square plate with a hole; elements are smaller at the hole."""

    def place(at: np.ndarray) -> np.ndarray:
        angle = np.pi / 2 * (1 - at[..., 0])
        along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        edge = half / along.max(axis=-1)
        along *= (radius + (edge - radius) * at[..., 1] ** 1.5)[..., None]
        return np.concatenate([along, thick * at[..., 2:]], axis=-1)

    return place


def bent(inner: float) -> Map:
    """Two legs of 3 x 1 x 1.5 at a right angle, and a third of the elements in the bend."""

    def place(at: np.ndarray) -> np.ndarray:
        out, arc = 1 - at[..., 1], np.pi / 2 * (inner + 0.5)
        s = np.interp(at[..., 0], [0, 1 / 3, 2 / 3, 1], [0, 3, 3 + arc, 6 + arc])
        angle = np.clip((s - 3) / (inner + 0.5), 0, np.pi / 2)
        x = np.minimum(s, 3) + (inner + out) * np.sin(angle)
        z = inner + 1 - (inner + out) * np.cos(angle) + np.maximum(s - 3 - arc, 0)
        return np.stack([x, 1.5 * (1 - at[..., 2]), z], axis=-1)

    return place


def twisted(at: np.ndarray) -> np.ndarray:
    """A bar of 6 x 1 x 1.4, twisted by a right angle."""
    y, z, angle = at[..., 1] - 0.5, 1.4 * (at[..., 2] - 0.5), np.pi / 2 * at[..., 0]
    across = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    return np.stack([6 * at[..., 0], *across], axis=-1)


def wavy(at: np.ndarray) -> np.ndarray:
    """A strip of 8 x 1 x 1 with one wave."""
    z = at[..., 2] - 0.5 + 0.6 * np.sin(2 * np.pi * at[..., 0])
    return np.stack([8 * at[..., 0], at[..., 1], z], axis=-1)


def parts() -> dict[str, Part]:
    """The twenty problems, by name."""
    planes = [(U_MIN, "x"), (U_MAX, "y"), (W_MIN, "z")]
    quarter = [{"at": at, "components": [axis]} for at, axis in planes]
    clamped, turn = [U_MIN], np.pi / 2
    pressed = [{"at": V_MIN, "pressure": 1e6}]
    in_x = [{"at": V_MAX, "traction": ["1e6 * (x > y)", 0, 0]}]  # on one of the two outer sides
    in_y = [{"at": V_MAX, "traction": [0, "1e6 * (y > x)", 0]}]
    x, y, z = ([{"at": U_MAX, "force": force}] for force in (100 * np.eye(3)).tolist())
    moment = [{"at": U_MAX, "moment": [100.0, 0.0, 0.0]}]
    return {
        "thick ring": ((4, 2, 1), ring(1, 2, turn, 0.5), quarter, pressed),
        "very thick ring": ((4, 3, 1), ring(1, 4, turn, 0.5), quarter, pressed),
        "thin ring": ((5, 1, 1), ring(4, 5, turn, 1), quarter, pressed),
        "hook": ((6, 2, 1), ring(1, 2.2, np.pi, 0.6), clamped, x),
        "flat hook": ((6, 1, 2), ring(2, 3, np.pi, 2), clamped, x),
        "notch in tension": ((8, 1, 2), notched(2, 0.6, 0.6), clamped, x),
        "notch in bending": ((8, 1, 3), notched(2, 0.8, 0.8), clamped, z),
        "wide notch": ((6, 1, 2), notched(2, 0.8, 1.5), clamped, z),
        "hump": ((8, 1, 2), notched(1, -0.6, 0.8), clamped, x),
        "neck in tension": ((8, 1, 2), notched(2, 0.5, 0.6, 2), clamped, x),
        "neck in bending": ((8, 1, 2), notched(2, 0.5, 0.8, 2), clamped, z),
        "neck bent sideways": ((6, 2, 2), notched(2, 0.4, 1, 2), clamped, y),
        "small hole": ((4, 4, 1), drilled(1, 4, 0.5), quarter, in_x),
        "large hole": ((4, 3, 1), drilled(2, 4, 1), quarter, in_x),
        "deep hole": ((4, 3, 2), drilled(1, 3, 3), quarter, in_y),
        "tight bend": ((9, 2, 1), bent(0.6), clamped, x),
        "round bend": ((6, 1, 1), bent(2), clamped, x),
        "bend, bent sideways": ((9, 2, 1), bent(1), clamped, y),
        "twisted bar": ((5, 2, 2), twisted, clamped, moment),
        "wavy strip": ((8, 1, 2), wavy, clamped, z),
    }


def finer(name: str, counts: Counts) -> Counts:
    """More elements; a single one across stays, and kinks of the map stay between elements."""
    u, v, w = (int(np.ceil(FINER * n)) for n in counts)
    u = 3 * round(counts[0] / 3) if "bend," in name or name.endswith(" bend") else u
    return u, v, w if counts[2] > 1 else 1


def solved(spline: Spline, supports: Any, loads: Any) -> Deformation:
    """The solution of the statics of steel."""
    analysis = build("analysis", {"plugin": "static", "fixed": supports, "loads": loads})
    found: Deformation = analysis(spline)
    return found


def main() -> None:
    """Solve all problems and write the table."""
    lines, ratios = [], []
    for name, (few, place, supports, loads) in parts().items():
        row = []
        for counts in (few, finer(name, few)):
            spline = solid(counts, place)
            eight: Counts = (2 * counts[0], 2 * counts[1], 2 * counts[2])
            fine = solid(eight, partial(on_elements, spline, counts))
            one, two = (solved(each, supports, loads).peak for each in (spline, fine))
            assert one is not None and two is not None
            off = abs(one.value - two.value)
            shares = [f"{100 * each / two.value:.2g}" for each in (off, one.error, two.error)]
            row.append(f"{' x '.join(map(str, counts))} | {' | '.join(shares)}")
            ratios.append(one.error / off)
        lines.append(f"| {name} | {' | '.join(row)} |")
    head = "elements | error, % | estimate, % | of the reference, %"
    table = [f"| solid | {head} | {head} |", "|---" * 9 + "|", *lines, ""]
    within = np.mean(np.array(ratios) >= 1)
    table.append(
        f"Within the estimate: {within:.0%}; ratio in the median: {np.median(ratios):.1f}."
    )
    Path(sys.argv[1]).write_text("\n".join(table) + "\n")


if __name__ == "__main__":
    main()
