"""The section of the hex mesh: certificate in words, worst hexes, before and after, primitives."""

import numpy as np
import pytest

from polycube.hexmesh.face_groups import facing, measure
from polycube.pipeline.state import RunState
from polycube.report.numbers import quality
from polycube.report.page.hexes import hexes
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.html import Outline


@pytest.fixture(scope="module")
def numbers(run) -> dict[str, object]:
    return quality.full(run.hexes, run.surface, run.polycube.context)


def text(page: str) -> str:
    return " ".join(" ".join(Outline(page).text).split())


def test_measures_worst_hexes_and_distances_are_told(run, numbers) -> None:
    numbers = numbers | {"surface_to_mesh_max": 0.0123}
    told = text(hexes(run, {"hex": numbers}, {"cells": b"\x89PNG"}))
    worst = numbers["worst"][0]
    assert f"scaled Jacobian {worst['hex']} {worst['scaled_jacobian']:.4g}" in told
    assert ", ".join(f"{c:.4g}" for c in worst["center"]) in told
    assert f"{numbers['quality']['edge_ratio']['max']:.4g}" in told
    assert f"{numbers['quality']['condition']['mean']:.4g}" in told
    assert f"input to hex mesh 1.23 % ({0.0123 * numbers['deviation']['diagonal']:.4g})" in told
    assert "Jacobian positive everywhere (Bernstein bounds)" in told
    assert (
        "0 cube" in told
        and "1 hole_z" in told
        and "2 grid cells (1 cube, 1 hole_z), moved apart" in told
    )
    assert "Before and after" not in told


@pytest.mark.parametrize(
    ("certificate", "words"),
    [
        ({"positive_at_corners": False}, "none: not positive at all corners"),
        ({"not_positive": 1, "undecided": 1, "not_certified": [3, 9]}, "not everywhere in 2: 3, 9"),
        ({"not_positive": 7, "not_certified": list(range(7))}, "in 7: 0, 1, 2, 3, 4, ..."),
    ],
)
def test_the_certificate_says_what_is_not_certain(certificate, words, run) -> None:
    whole = {"positive_at_corners": True, "positive_everywhere": False, "undecided": 0}
    assert words in text(hexes(run, {"hex": {"certificate": whole | certificate}}, {}))


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
    whole = quality.full(fine, surface)
    assert whole["faces_without_quads"] == []
    run = RunState(surface, path="strip.step", hexes=fine)
    assert "CAD faces without a quad 0 of 7" in text(hexes(run, {"hex": whole}, {}))


def test_before_and_after_where_the_run_began_with_hexes(run, numbers) -> None:
    given = quality.short(run.hexes, run.surface) | {"min_scaled_jacobian": 0.12345}
    pictures = {"given": b"\x89PNG", "cut": b"\x89PNG"}
    told = text(hexes(run, {"hex": numbers, "given": given}, pictures))
    assert told.count("cut open") == 2 and "Cut open" not in told
    before, after = told.index("as given"), told.index("improved")
    assert "0.1235" in told[before:after] or "0.1234" in told[before:after]
    assert f"{numbers['min_scaled_jacobian']:.4g}" in told[after : after + 60]


def test_many_grid_cells_are_counted_and_not_named(run) -> None:
    mesh = run.hexes
    many = HexMesh(mesh.vertices, mesh.hexes, mesh.quads, mesh.patch, np.arange(len(mesh.hexes)))
    state = RunState(run.surface, hexes=many)
    told = text(hexes(state, {}, {"cells": b"\x89PNG"}))
    assert f"in its {len(mesh.hexes)} grid cells, moved apart" in told and "7 hole" not in told


def test_without_numbers_the_mesh_is_still_shown(run) -> None:
    told = text(hexes(run, {}, {}))
    assert "Hex mesh" in told and "Worst hexes" not in told and "Primitives" not in told
    assert hexes(RunState(run.surface), {}, {}) == ""
