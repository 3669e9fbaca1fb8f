"""The pages escape every name: a name from a file never becomes a tag, an attribute or a scheme.

Each page is written twice, with a plain name and with one that contains markup. The tags of both
pages are equal, and their texts differ only in the name.
"""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import quote, unquote

import pytest
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from docs.generators.benchmark.numbers import PartResult
from docs.generators.benchmark.page import benchmark_page
from polycube.report.page.html import assembly_page, page, summary_page, write_report
from polycube.report.page.templates import FOLDER, Link, Swatch, environment, show
from polycube.state import RunState
from tests.conftest import ROOT, first_quick

PLAIN = "Aname"
ODD = (
    "<script>alert(1)</script>",
    "</script></style><b>",
    '" onmouseover="alert(1)" x=\'',
    "&lt;&amp;&#60;",
    "A\nb\tc",
    "Gehäuse – 部件 \u202e🔩",
    "${title} $$ {0} %s",
    "JavaScript:alert(1)#?%",
)
PLUGINS = {"meshing": {"order": []}, "spline": {"plugin": ""}, "analysis": {"plugin": ""}}
FEATURES = {kind: {"all": 4, "lost": 1} for kind in ("points", "curves", "faces")}


class Structure(HTMLParser):
    """Tags of a page with the names of their attributes, its text, its values, its addresses."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags, self.text, self.values, self.addresses = [], "", "", []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attributes) -> None:
        self.tags.append((tag, *(name for name, _ in attributes)))
        given = dict(attributes)
        if "href" in given:
            self.addresses.append(given.pop("href"))
        self.values += "".join(value or "" for value in given.values())

    def handle_endtag(self, tag) -> None:
        self.tags.append(("/", tag))

    def handle_data(self, data) -> None:
        self.text += data

    def shown(self, name: str) -> str:
        """The text, with the name in place of its forms in JSON: of settings, and in a script."""
        quoted = json.dumps(name)[1:-1]
        in_script = str(htmlsafe_json_dumps(name))[1:-1]
        return self.text.replace(in_script, name).replace(quoted, name)


def check(plain: str, odd: str, name: str) -> int:
    """Check that two pages differ only in the name; returns how often the page contains it."""
    one, other = Structure(plain), Structure(odd)
    assert one.tags == other.tags
    assert one.text.replace(PLAIN, name) == other.shown(name)
    assert one.values.replace(PLAIN, name) == other.values
    assert [unquote(a).replace(PLAIN, name) for a in one.addresses] == [
        unquote(a) for a in other.addresses
    ]
    assert not any(re.match("[a-zA-Z]+:", address) for address in other.addresses)
    return one.text.count(PLAIN) + one.values.count(PLAIN)


def counts(name: str) -> dict[str, object]:
    row = {"at": name, "kind": "around", "wanted": 3, "reached": 2}
    return {"at": [{**row, "met": False}], "walls": 1, "holes": 1, "fewer": [row]}


def features(name: str) -> dict[str, object]:
    own = {"at": [0, 0, 0], "faces": [name], "names": [name]}
    lost = {**own, "kind": "face", "shape": name, "length": 1.0, "distance": 0.1}
    acute = {**own, "kind": "edge", "degrees": 3.0}
    return {**FEATURES, "tolerance": 0.01, "lost": [lost], "acute": [acute]}


def page_of_a_run(run: RunState, name: str, folder: Path) -> str:
    """A page with the name as part, set, CAD face, primitive, option, warning, failure, unit."""
    sets = {name: run.hexes.sets["hole_1"], f"patch_{name}": run.hexes.sets["patch_0"]}
    of_set = {"kind": "hole", "quads": 3, "area": 1.0, "centroid": [0, 0, 0], "normal": [0, 0, 1]}
    surface = replace(
        run.surface, region=1 + (run.surface.faces[:, 0] > 9), region_names=(name, name)
    )
    hexes = replace(run.hexes, sets=sets)
    candidate = {"proposal": name, "context": [name, None], "key": name, "score": 0.25}
    repair = {"changes": [name], "level": name, "volume_before": 1, "volume_after": 1}
    repair |= {key: None for key in ("deviation", "deviation_percent", "added", "lost", "cell")}
    report = {
        "valid": False,
        "failure": name,
        "input": {"path": "part", "genus": 1},
        "repair": repair,
        "polycube": {"candidates": [candidate], "chosen": 0, "context": [name, name]},
        "hex": {
            "sets": {name: of_set, f"patch_{name}": of_set},
            "counts": counts(name),
            "features": features(name),
        },
        "spline": {"functions": 4, name: name},
        "modes": {"frequency_hz": [], "units": {"length": name, "frequency": name}},
        "problem": {
            "units": name,
            "material": name,
            "supports": [{"words": name, "quads": 1, "area": 1.0}],
            "loads": [{"words": name, "quads": None, "area": None}],
        },
        "made": {"date": "", "machine": name},
        "seconds": {name: 1.0, "read": 2.0},
        "warnings": [name],
        "mesh_warnings": [name],
        "stopped": name,
        "version": name,
        "seed": name,
        "config": {name: {name: [name]}, **PLUGINS},
    }
    state = replace(run, surface=surface, hexes=hexes, path=name)
    return write_report(folder, state, report, drawing=False).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", first_quick(3, ODD))
def test_the_page_of_a_run(name: str, run: RunState, tmp_path: Path) -> None:
    plain = page_of_a_run(run, PLAIN, tmp_path / "plain")
    odd = page_of_a_run(run, name, tmp_path / "odd")
    assert check(plain, odd, name) >= 28


@pytest.mark.parametrize("name", ODD)
def test_the_page_of_a_batch(name: str, tmp_path: Path) -> None:
    def made(word: str) -> str:
        folder = tmp_path / word.replace("/", "|")
        folder.mkdir()
        (folder / "report.html").touch()
        row = {"part": word, word: word, "says": word, "folder": folder.name}
        return summary_page([row], [*row], tmp_path)

    assert check(made(PLAIN), made(name.replace("/", "|")), name.replace("/", "|")) == 4


@pytest.mark.parametrize("name", ODD)
def test_the_page_of_an_assembly(name: str, tmp_path: Path) -> None:
    def made(word: str) -> str:
        row = {"name": word, "number": 1, "volume": 2.0, "exit": 2, "result": word, "says": word}
        row |= {"hexes": None, "features": FEATURES, "same_as": word}
        row["min_scaled_jacobian"] = None
        contact = {"solids": [word, word], "faces": [word, word], "names": [word, ""]}
        contact |= {"area": 1.0, "agree": False}
        report = {"valid": False, "failure": word, "solids": [row], "contacts": [contact]}
        return assembly_page(word, report, None, tmp_path, [word])

    assert check(made(PLAIN), made(name), name) >= 10


@pytest.mark.parametrize("name", ODD)
def test_the_page_of_a_benchmark(name: str) -> None:
    def made(word: str) -> str:
        row = {"part": word, "result": word, "says": word, "folder": word}
        part = PartResult(word, row, {})
        return benchmark_page(word, [part], {word: b"png"}, {word: part}, word)

    assert check(made(PLAIN), made(name), name) >= 6


ELEMENTS = """{% from "elements.html" import facts, figure, folded, section, swatches, table %}
{{ {word: [word, swatch, link]}|show }}{{ facts({word: word}) }}{{ table([{word: word}]) }}
{% call folded(word) %}{% endcall %}{{ figure(picture, word, wide=true) }}
{{ swatches([(word, "#fff")]) }}{% call section("x", word) %}{{ word }}{% endcall %}"""


@pytest.mark.parametrize("name", ODD)
def test_every_element(name: str) -> None:
    def made(word: str) -> str:
        swatch, link = Swatch(word, "#fff"), Link(word, word)
        values = {"word": word, "swatch": swatch, "link": link, "picture": b"png"}
        elements = Markup(environment().from_string(ELEMENTS).render(values))
        return page(word, elements, note=word, subtitle=word)

    assert check(made(PLAIN), made(name), name) == 18
    assert show(Link("x", name)).count(quote(name)) == 1


TEMPLATES = sorted([*FOLDER.glob("*.html"), *(ROOT / "docs/generators/benchmark").glob("*.html")])


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.name)
def test_no_template_switches_escaping_off(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert environment().autoescape and "autoescape" not in text
    assert not re.search(r"\|\s*(safe|forceescape)\b", text)
