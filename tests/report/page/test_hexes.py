"""The section of the hex mesh: certificate, worst hexes, before and after, primitives."""

import numpy as np
import pytest

from polycube.hexmesh.face_groups import facing, measure
from polycube.report.numbers import quality
from polycube.report.page.hexes import hexes
from polycube.state import RunState
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.html import Outline


@pytest.fixture(scope="module")
def numbers(run) -> dict[str, object]:
    return quality.full(run.hexes, run.surface, run.polycube.context)


def text(page: str) -> str:
    return " ".join(" ".join(Outline(page).text).split())


def test_measures_worst_hexes_and_distances_are_shown(run, numbers) -> None:
    numbers = numbers | {"surface_to_mesh_max": 0.0123}
    shown = text(hexes(run, {"hex": numbers}, {"cells": b"\x89PNG"}))
    worst = numbers["worst"][0]
    assert f"scaled Jacobian {worst['hex']} {worst['scaled_jacobian']:.4g}" in shown
    assert ", ".join(f"{c:.4g}" for c in worst["center"]) in shown
    assert f"{numbers['quality']['edge_ratio']['max']:.4g}" in shown
    assert f"{numbers['quality']['condition']['mean']:.4g}" in shown
    assert f"input to hex mesh 1.23 % ({0.0123 * numbers['deviation']['diagonal']:.4g})" in shown
    assert "Jacobian positive everywhere (Bernstein bounds)" in shown
    assert (
        "0 cube" in shown
        and "1 hole_z" in shown
        and "2 grid cells (1 cube, 1 hole_z), moved apart" in shown
    )
    assert "Before and after" not in shown


@pytest.mark.parametrize(
    ("certificate", "sentence"),
    [
        ({"positive_at_corners": False}, "none: not positive at all corners"),
        ({"not_positive": 1, "undecided": 1, "not_certified": [3, 9]}, "not everywhere in 2: 3, 9"),
        ({"not_positive": 7, "not_certified": list(range(7))}, "in 7: 0, 1, 2, 3, 4, ..."),
    ],
)
def test_the_certificate_says_what_is_not_certain(certificate, sentence, run) -> None:
    complete = {"positive_at_corners": True, "positive_everywhere": False, "undecided": 0}
    assert sentence in text(hexes(run, {"hex": {"certificate": complete | certificate}}, {}))


def test_cad_faces_without_a_quad_are_named() -> None:
    """The lower side of a box has a strip that is thinner than a quad of the mesh."""
    fine = hex_box((20, 1, 1))
    normal, middle = (getattr(measure(fine.vertices[fine.quads]), n) for n in ("normal", "middle"))
    region = facing(normal) + 1
    region[(region == 5) & (middle[:, 0] < 0.05)] = 7
    mesh, surface = hex_box((2, 1, 1)), surface_of(fine, region)
    found = quality.full(mesh, surface)
    assert found["faces_without_quads"] == ["cad_face_7"]
    run = RunState(surface, path="strip.step", hexes=mesh)
    assert "CAD faces without a quad 1 of 7: cad_face_7" in text(hexes(run, {"hex": found}, {}))
    numbers = quality.full(fine, surface)
    assert numbers["faces_without_quads"] == []
    run = RunState(surface, path="strip.step", hexes=fine)
    assert "CAD faces without a quad 0 of 7" in text(hexes(run, {"hex": numbers}, {}))


def test_before_and_after_where_the_run_began_with_hexes(run, numbers) -> None:
    given = quality.short(run.hexes, run.surface) | {"min_scaled_jacobian": 0.12345}
    pictures = {"given": b"\x89PNG", "cut": b"\x89PNG"}
    shown = text(hexes(run, {"hex": numbers, "given": given}, pictures))
    assert shown.count("cut open") == 2 and "Cut open" not in shown
    before, after = shown.index("as given"), shown.index("improved")
    assert "0.1235" in shown[before:after] or "0.1234" in shown[before:after]
    assert f"{numbers['min_scaled_jacobian']:.4g}" in shown[after : after + 60]


def test_many_grid_cells_are_counted_and_not_named(run) -> None:
    mesh = run.hexes
    many = HexMesh(mesh.vertices, mesh.hexes, mesh.quads, mesh.patch, np.arange(len(mesh.hexes)))
    state = RunState(run.surface, hexes=many)
    shown = text(hexes(state, {}, {"cells": b"\x89PNG"}))
    assert f"in its {len(mesh.hexes)} grid cells, moved apart" in shown and "7 hole" not in shown


def test_without_numbers_the_mesh_is_still_shown(run) -> None:
    shown = text(hexes(run, {}, {}))
    assert "Hex mesh" in shown and "Worst hexes" not in shown and "Primitives" not in shown
    assert hexes(RunState(run.surface), {}, {}) == ""
