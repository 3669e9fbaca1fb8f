"""The page as people meet it: in a browser, with a mouse, on a phone, in the dark, on paper."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.numbers import quality
from polycube.report.page import html
from polycube.report.page.html import summary_page
from polycube.report.page.views import viewer
from polycube.report.page.views.comparison import write_view
from tests.fixtures import browser
from tests.fixtures.hexmeshes import hex_box, hex_cylinder

pytestmark = pytest.mark.slow  # each window takes seconds
CANVAS = ".viewer canvas"
# visible texts with a font size of less than 14 CSS pixels
SMALL = """[...document.querySelectorAll('body *')].filter((e) => e.getClientRects().length
  && !e.closest('script') && [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim())
  && parseFloat(getComputedStyle(e).fontSize) < 14).map((e) => e.outerHTML.slice(0, 80))"""
# controls that are too small for a finger: less than 32 pixels high, without the bars of the
# histogram, which have its height
NARROW = """[...document.querySelectorAll('button, select, input, summary, nav a')]
  .filter((e) => !e.disabled && e.getClientRects().length
  && (e.closest('label') || e).getBoundingClientRect().height < 32).map((e) => e.outerHTML)"""
# smallest contrast of a text with its background
CONTRAST = """(() => {
  const parse = (c) => c.match(/[\\d.]+/g).map(Number);
  const light = (c) => parse(c).slice(0, 3).map((x) => x / 255)
    .map((x) => (x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4))
    .reduce((s, x, i) => s + x * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (e) => { for (; e; e = e.parentElement) {
    const c = getComputedStyle(e).backgroundColor;
    if (parse(c).length < 4 || parse(c)[3] > 0) return c; } return 'rgb(255, 255, 255)'; };
  return Math.min(...[...document.querySelectorAll('main *')].filter((e) =>
    e.getClientRects().length && [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim()))
    .map((e) => { const [a, b] = [light(getComputedStyle(e).color), light(behind(e))];
      return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05); }));
})()"""
WIDER = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


@pytest.fixture(scope="module")
def report(run) -> dict[str, object]:
    numbers = quality.full(run.hexes, run.surface, run.polycube.context)
    box = [run.surface.vertices.min(0).tolist(), run.surface.vertices.max(0).tolist()]
    modes = run.solution
    frequency = {"frequency_hz": modes.frequency.tolist(), "rigid": 6, "units": dict(modes.units)}
    ranked = {"proposal": "slices", "context": ["cube", "hole_z"], "key": "k", "score": 0.25}
    return {
        "valid": True,
        "mesh_warnings": ["the volume is 93 % of the surface's"],
        "warnings": ["3 vertices welded"],
        "input": {"path": "parts/a_part_with_a_long_name_that_goes_on_and_on.stl", "bbox": box},
        "polycube": {"grid": [2, 1, 1], "candidates": [ranked] * 3, "chosen": 0},
        "hex": numbers,
        "modes": frequency,
        "seconds": {"read": 0.5, "meshing/optimize": 9.5},
        "config": {"mesh": "bent.stl", "meshing": {"order": []}, "analysis": {"plugin": "modal"}},
    }


@pytest.fixture(scope="module")
def window() -> Iterator[browser.Page]:
    program = browser.found()
    if program is None:
        pytest.skip("no browser found; install chromium, or name one in POLYCUBE_BROWSER")
    with browser.browser(program) as page:
        yield page


@pytest.fixture(scope="module")
def page(window, run, report, drawn, written, tmp_path_factory):
    return written(tmp_path_factory.mktemp("page"), run, report, drawn)


@pytest.fixture
def desktop(window, page) -> browser.Page:
    """The page, newly loaded, with its 3D view drawn."""
    window.media()
    window.size(1280, 900)
    window.messages.clear()
    window.requests.clear()
    window.open(page)
    window.wait("document.querySelector('.viewer output').textContent.includes('hexes')")
    return window


def changed(before: np.ndarray, after: np.ndarray) -> float:
    """Share of the pixels that are another."""
    assert before.shape == after.shape
    return float((np.abs(before.astype(int) - after) > 8).any(axis=2).mean())


def status(page: browser.Page) -> str:
    return page.run("document.querySelector('.viewer output').textContent")


def test_it_opens_without_messages_and_without_the_network(desktop, page) -> None:
    assert desktop.messages == []
    assert [a for a in desktop.requests if not a.startswith("data:")] == [page.resolve().as_uri()]


def test_the_first_screen_has_the_verdict_and_the_main_numbers(desktop, run, report) -> None:
    shown = desktop.run(
        "[...document.querySelectorAll('header *')].filter((e) => "
        "e.getBoundingClientRect().bottom <= innerHeight).map((e) => e.textContent).join(' ')"
    )
    assert "Valid hex mesh with warnings" in shown and "93 % of the surface" in shown
    assert f"{report['hex']['min_scaled_jacobian']:.3f}" in shown
    assert f"{len(run.hexes.hexes)}" in shown and "Jacobian positive" in shown
    assert "of the diagonal" in shown and "volume error" in shown
    assert f"{run.solution.frequency[6]:.4g} Hz" in shown
    assert desktop.box("canvas")[1] < 900  # and the part is there without scrolling far


def test_a_drag_turns_the_part(desktop) -> None:
    before = desktop.picture(CANVAS)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 20  # it is not an empty canvas
    desktop.drag(CANVAS, 90, 30)
    assert changed(before, desktop.picture(CANVAS)) > 0.05
    desktop.click("[name=home]")
    assert changed(before, desktop.picture(CANVAS)) < 0.01


def test_the_plane_cuts_hexes_off(desktop, run) -> None:
    n = len(run.hexes.hexes)
    before = desktop.picture(CANVAS)
    desktop.set("[name=cut]", 0.3)  # chooses an axis where none was
    assert desktop.run("document.querySelector('[name=axis]').value") == "x"
    first, left = desktop.picture(CANVAS), int(status(desktop).split(" of ")[0])
    assert 0 < left < n and changed(before, first) > 0.02
    desktop.set("[name=cut]", 0.7)
    assert int(status(desktop).split(" of ")[0]) != left
    assert changed(first, desktop.picture(CANVAS)) > 0.02
    now = int(status(desktop).split(" of ")[0])
    desktop.set("[name=flip]", True)
    assert int(status(desktop).split(" of ")[0]) == n - now


def test_a_large_mesh_is_hollow_where_it_is_cut(window, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(viewer, "ALL_SHOWN", 100)
    monkeypatch.setattr(viewer, "WORST", 1)
    mesh = hex_box((8, 8, 8))
    path = tmp_path / "large.html"
    path.write_text(html.page("box", viewer.viewer(mesh)), encoding="utf-8")
    window.messages.clear()
    window.open(path)
    window.wait("document.querySelector('.viewer output').textContent.includes('hexes')")
    shell = 8**3 - 6**3
    assert status(window).startswith((f"{shell} of 512 hexes; of the", f"{shell + 1} of 512"))
    window.set("[name=cut]", 0.5)
    half = int(status(window).split(" of ")[0])
    assert shell // 2 <= half <= shell // 2 + 1
    window.click("[name=worst]")
    assert status(window).startswith("hex ") and window.messages == []


def test_all_edges_in_front_are_seen(window, tmp_path) -> None:
    plain = hex_cylinder(6, 6, 12)
    mesh = replace(plain, vertices=plain.vertices * [1, 1, 6])
    path = tmp_path / "tall.html"
    path.write_text(html.page("tall", viewer.viewer(mesh)), encoding="utf-8")
    window.media()
    window.size(1280, 900)
    window.open(path)
    window.wait("document.querySelector('.viewer output').textContent.includes('hexes')")
    drawn = window.picture(CANVAS)
    window.click("[name=edges]")
    share = changed(drawn, window.picture(CANVAS))
    assert share == pytest.approx(0.0186, rel=0.05)  # 0.0148 where a fifth lies behind the faces


def test_results_side_by_side_move_together(window, run, tmp_path) -> None:
    folders = [tmp_path / "coarse", tmp_path / "part"]
    for folder, mesh in zip(folders, (hex_box((2, 2, 2)), run.hexes), strict=True):
        folder.mkdir()
        shown = viewer.viewer(mesh, run.surface)
        (folder / "report.html").write_text(html.page(folder.name, shown), encoding="utf-8")
        (folder / "report.json").write_text('{"valid": true}')
    path = write_view(folders, tmp_path)
    window.media()
    window.size(1280, 900)
    window.messages.clear()
    window.open(path)
    window.wait(
        "[...document.querySelectorAll('output')].every((e) => e.textContent.includes('hexes'))"
    )
    first, second = (f".views > :nth-child({i}) " for i in (1, 2))
    before = window.picture(second + "canvas")
    window.drag(first + "canvas", 90, 30)
    assert changed(before, window.picture(second + "canvas")) > 0.05
    window.click(first + "[name=home]")
    assert changed(before, window.picture(second + "canvas")) < 0.01
    window.set(first + "[name=cut]", 0.3)
    n_hexes = len(run.hexes.hexes)
    status_text = window.run(f"document.querySelector('{second} output').textContent")
    assert int(status_text.split(" of ")[0]) < n_hexes
    assert changed(before, window.picture(second + "canvas")) > 0.02
    window.click(first + "[name=edges]")
    assert not window.run(f"document.querySelector('{second} [name=edges]').checked")
    window.set(first + "[name=colour]", "distance")
    assert window.run(f"document.querySelector('{second} [name=colour]').value") == "distance"
    assert window.messages == [] and window.run(WIDER) == 0


@pytest.mark.parametrize("colouring", ["distance", "cell", "set", "primitive"])
def test_the_colouring_can_be_chosen(desktop, colouring) -> None:
    before = desktop.picture(CANVAS)
    desktop.set("[name=colour]", colouring)
    assert changed(before, desktop.picture(CANVAS)) > 0.02
    shown = desktop.run(
        "[...document.querySelectorAll('[data-colour]')].filter((e) => !e.hidden)"
        ".map((e) => e.dataset.colour)"
    )
    assert shown == [colouring]


def test_the_input_surface_lies_over_the_mesh(desktop) -> None:
    before = desktop.picture(CANVAS)
    desktop.set("[name=input]", True)
    assert changed(before, desktop.picture(CANVAS)) > 0.05
    desktop.set("[name=input]", False)
    assert changed(before, desktop.picture(CANVAS)) < 0.01


def test_a_mode_bends_and_colours_the_part(desktop) -> None:
    desktop.set("[name=colour]", "result0")
    bent = desktop.picture(CANVAS)
    desktop.set("[name=deformed]", 0)
    assert changed(bent, desktop.picture(CANVAS)) > 0.02
    desktop.set("[name=colour]", "quality")
    assert desktop.run("document.querySelector('[name=deformed]').disabled")


def test_only_the_worse_hexes_are_left(desktop, run) -> None:
    jacobian = scaled_jacobian(run.hexes.vertices, run.hexes.hexes)
    most = round(float(np.median(jacobian)), 2)
    desktop.set("[name=most]", most)
    assert status(desktop).startswith(f"{int((jacobian <= most).sum())} of {len(jacobian)} hexes")


def test_a_bar_of_the_histogram_shows_its_hexes(desktop, run) -> None:
    jacobian = scaled_jacobian(run.hexes.vertices, run.hexes.hexes)
    bar = ".histogram button:not([disabled])"
    low = float(desktop.run(f"document.querySelector('{bar}').dataset.low"))
    desktop.click(bar)
    count = int(((jacobian >= low) & (jacobian <= low + 0.05)).sum())
    assert status(desktop).startswith(
        f"{count} of {len(jacobian)} hexes, scaled Jacobian {low:.2f}"
    )


def test_a_click_on_a_hex_shows_its_numbers(desktop, run) -> None:
    desktop.click("[name=worst]")
    jacobian = scaled_jacobian(run.hexes.vertices, run.hexes.hexes)
    assert status(desktop).startswith(
        f"hex {jacobian.argmin()}: scaled Jacobian {jacobian.min():.3f}"
    )
    desktop.click("[name=home]")
    _, _, width, height = desktop.box(CANVAS)
    seen = desktop.picture(CANVAS).astype(int)
    inside = np.abs(seen - seen[2, 2]).sum(2) > 60
    row, column = np.argwhere(inside)[inside.sum() // 3]
    desktop.click(CANVAS, column + 0.5 - width / 2, row + 0.5 - height / 2)
    shown = status(desktop)
    assert shown.startswith("hex ") and "cell " in shown
    assert "; in " in shown and "patch_" in shown.split("; in ")[1]
    number = int(shown.split()[1].rstrip(":"))
    assert f"{jacobian[number]:.3f}" in shown
    at = np.array(shown.split("(")[1].split(")")[0].split(","), float)
    middle = run.hexes.vertices[run.hexes.hexes[number]].mean(0)
    np.testing.assert_allclose(at, middle, rtol=1e-3, atol=1e-2)


def test_the_keyboard_turns_it_too(desktop) -> None:
    before = desktop.picture(CANVAS)
    desktop.run("document.querySelector('canvas').focus()")
    desktop.send("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft")
    desktop.frame()
    assert changed(before, desktop.picture(CANVAS)) > 0.02


def test_the_modes_swing(desktop) -> None:
    film = "#modes img[src^='data:image/gif']"
    first = desktop.picture(film)
    assert any(changed(first, desktop.picture(film)) > 0.01 for _ in range(20))


def test_a_phone_shows_all_of_it(desktop, page) -> None:
    desktop.size(390, 844, phone=True)
    desktop.open(page)
    desktop.wait("document.querySelector('.viewer output').textContent.includes('hexes')")
    assert desktop.run(WIDER) == 0
    desktop.run("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
    assert desktop.run(WIDER) == 0
    assert desktop.run(SMALL) == [] and desktop.run(NARROW) == []
    left, _, width, height = desktop.box(CANVAS)
    assert left >= 16 and left + width <= 374 and height < 420  # room to scroll next to it


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_enough_contrast(desktop, scheme) -> None:
    desktop.media(prefers_color_scheme=scheme)
    desktop.frame()
    assert desktop.run(CONTRAST) > 4.5
    background = desktop.run("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, background[4:-1].split(","))) < 200) == (scheme == "dark")
    assert desktop.run(SMALL) == []


def test_paper_is_white_and_holds_the_numbers(desktop) -> None:
    desktop.media("print", prefers_color_scheme="dark")
    desktop.frame()
    assert desktop.run("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    shown = "document.querySelector('{}').getClientRects().length"
    assert desktop.run(shown.format("#view")) == 0 < desktop.run(shown.format(".paper img"))
    assert desktop.run("document.querySelector('header').offsetHeight") < 1050  # A4 at 96 dpi
    assert desktop.run("document.querySelector('.controls').getClientRects().length") == 0
    desktop.run("dispatchEvent(new Event('beforeprint'))")
    assert desktop.run("[...document.querySelectorAll('details:not(.long)')].every((e) => e.open)")
    paper = desktop.send("Page.printToPDF", printBackground=True)["data"]
    assert paper.startswith("JVBERi0")  # %PDF-


def test_the_table_of_a_batch_fits_a_phone_too(window, tmp_path) -> None:
    rows = [
        {"part": f"part{i}", "result": "valid", "hexes": 1000, "says": "x" * 90, "folder": "a"}
        for i in range(3)
    ]
    path = tmp_path / "summary.html"
    path.write_text(summary_page(rows, list(rows[0]), tmp_path), encoding="utf-8")
    window.media()
    window.size(390, 844, phone=True)
    window.open(path)
    assert window.run(WIDER) == 0 and window.run(SMALL) == []
