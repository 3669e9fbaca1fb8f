"""The section of numbers of hexes on the page."""

from polycube.report.page.hexes import N_SHOWN, hex_counts
from tests.fixtures.html import Outline


def text(page: str) -> str:
    return " ".join(" ".join(Outline(page).text).split())


def row(at, kind, wanted, reached, **more):
    return {"at": at, "kind": kind, "wanted": wanted, "reached": reached, **more}


def test_entries_that_are_not_met_come_first():
    requests = [
        row("hole_1", "around", 16, 18, met=True),
        row("cad_WEB", "through", 3, 2, met=False),
    ]
    fewer = [row("cad_face_2", "through", 2, 1.0), row("hole_2", "around", 8, 6.0)]
    counts = {"at": requests, "walls": 9, "holes": 2, "fewer": fewer}
    page = text(hex_counts({"hex": {"counts": counts}}))
    assert "1 of 2 entries of meshing.at are met." in page
    assert "1 of 9 faces have fewer hexes" in page and "1 of 2 holes have fewer edges" in page
    assert page.index("cad_WEB hexes through 3 2 not met") < page.index(
        "hole_1 edges round 16 18 met"
    )
    assert "cad_face_2 hexes through 2 1 not met" in page


def test_ten_rows_are_listed():
    fewer = [row(f"cad_face_{n}", "through", 2, 1) for n in range(30)]
    page = text(
        hex_counts({"hex": {"counts": {"at": [], "walls": 40, "holes": 0, "fewer": fewer}}})
    )
    assert page.count("not met") == N_SHOWN
    assert f"The worst {N_SHOWN} are listed" in page and "meshing.at" not in page


def test_a_report_without_counts_has_no_section():
    assert hex_counts({}) == "" == hex_counts({"hex": {}})
