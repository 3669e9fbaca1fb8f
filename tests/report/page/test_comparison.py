"""The page of several results side by side."""

import json
from pathlib import Path

import pytest

from polycube.errors import InputError
from polycube.report.page.html import page
from polycube.report.page.views.comparison import write_view
from polycube.report.page.views.viewer import viewer
from tests.fixtures.hexmeshes import hex_box

REPORT = {"valid": True, "hex": {"hexes": 8, "min": 1.0}}


@pytest.fixture(scope="module")
def html() -> str:
    return page("box", viewer(hex_box((2, 2, 2))))


@pytest.fixture
def results(html: str, tmp_path: Path) -> Path:
    """Results of two parts, one of them in two sizes."""
    for name in ("fine/a", "coarse/a", "b & c"):
        result(tmp_path / "results" / name, html)
    return tmp_path / "results"


def result(folder: Path, html: str) -> None:
    folder.mkdir(parents=True)
    (folder / "report.html").write_text(html, encoding="utf-8")
    (folder / "report.json").write_text(json.dumps(REPORT))


def test_all_results_are_shown_with_their_numbers(results: Path) -> None:
    chosen = [results / name for name in ("b & c", "coarse/a", "fine/a")]
    assert write_view(chosen, results) == results / "view.html"
    text = (results / "view.html").read_text(encoding="utf-8")
    assert text.count('<div class="viewer">') == 3
    assert "<title>3 results: polycube report</title>" in text
    for link in ("fine/a/report.html", "coarse/a/report.html", "b%20%26%20c/report.html"):
        assert text.count(f'<a href="{link}">') == 1
    assert text.count("<td>Valid hex mesh") == 3 and "<th>b &amp; c</th>" in text


def test_links_start_at_the_page(results: Path, here: Path) -> None:
    write_view([Path("results/fine/a"), results / "coarse/a"], Path())
    text = Path("view.html").read_text(encoding="utf-8")
    assert 'href="results/fine/a/report.html">fine/a<' in text
    write_view([Path("results/fine/a")], Path("other"))
    text = Path("other/view.html").read_text(encoding="utf-8")
    assert 'href="../results/fine/a/report.html">a<' in text


def test_a_file_of_the_user_is_kept(results: Path) -> None:
    chosen = [results / "fine/a"]
    write_view(chosen, results)
    write_view(chosen, results)  # its own page is replaced
    (results / "view.html").write_text("mine")
    with pytest.raises(InputError, match=r"view.html would be overwritten"):
        write_view(chosen, results)
    assert (results / "view.html").read_text() == "mine"


def test_refusals_are_one_sentence(results: Path) -> None:
    for damaged in ("[", "[]", '{"valid": true, "hex": 5}'):
        (results / "fine/a/report.json").write_text(damaged)
        with pytest.raises(InputError, match=r"report.json: it is not the report of a run"):
            write_view([results / "fine/a"], results)
    (results / "coarse/a/report.html").write_text("<p>failed</p>")
    with pytest.raises(InputError, match=r"report.html: it has no 3D view .* run infer.py again"):
        write_view([results / "coarse/a"], results)
    assert not list(results.rglob("view.html"))
