"""A name from outside is text wherever it goes in: it never becomes a tag or an attribute.

Every page is made twice, with a plain name and with an odd one: the tags are the same, and the text
differs by the name alone.
"""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import quote, unquote

import pytest

from polycube.pipeline.state import RunState
from polycube.report.numbers.benchmark import PartResult
from polycube.report.page.assembly import assembly_page
from polycube.report.page.benchmark import benchmark_page
from polycube.report.page.html import write_report
from polycube.report.page.markup import Link, Swatch, facts, figure, folded, section, show, table
from polycube.report.page.summary import summary_page

PLAIN = "aname"
ODD = (
    "<script>alert(1)</script>",
    "</script></style><b>",
    '" onmouseover="alert(1)" x=\'',
    "&lt;&amp;&#60;",
    "a\nb\tc",
    "Gehäuse – 部件 \u202e🔩",
    "${title} $$ {0} %s",
    "javascript:alert(1)#?%",
)
FEATURES = {kind: {"all": 4, "lost": 1} for kind in ("points", "curves", "faces")}


class Structure(HTMLParser):
    """Tags with the names of their attributes, the text between them, and addresses."""

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


def check(plain: str, odd: str, name: str) -> int:
    """Both pages are the same but for the name; how often it stands there."""
    one, other = Structure(plain), Structure(odd)
    assert one.tags == other.tags
    assert one.text.replace(PLAIN, name) == other.text
    assert one.values.replace(PLAIN, name) == other.values
    assert [unquote(a).replace(PLAIN, name) for a in one.addresses] == [
        unquote(a) for a in other.addresses
    ]
    assert not any(re.match("[a-z]+:", address) for address in other.addresses)
    return one.text.count(PLAIN) + one.values.count(PLAIN)


def counts(name: str) -> dict[str, object]:
    row = {"at": name, "kind": "around", "wanted": 3, "reached": 2}
    return {"at": [{**row, "met": False}], "walls": 1, "holes": 1, "fewer": [row]}


def features(name: str) -> dict[str, object]:
    lost = {"kind": "face", "at": [0, 0, 0], "faces": [name], "length": 1.0, "distance": 0.1}
    acute = {"kind": "edge", "at": [0, 0, 0], "faces": [name], "angle": 3.0, "length": 1.0}
    return {**FEATURES, "lost": [lost], "acute": [acute]}


def page_of_a_run(run: RunState, name: str, folder: Path) -> str:
    """With the name as part, folder, set, CAD face, primitive, option, warning, failure, unit."""
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
        "input": {"path": f"/folder of {PLAIN}/{name.replace('/', '|')}", "genus": 1},
        "repair": repair,
        "polycube": {"candidates": [candidate], "chosen": 0, "context": [name, name]},
        "hex": {
            "sets": {name: of_set, f"patch_{name}": of_set},
            "counts": counts(name),
            "features": features(name),
        },
        "spline": {"functions": 4, name: name},
        "modes": {"units": {"length": name, "frequency": name}},
        "seconds": {name: 1.0, "read": 2.0},
        "warnings": [name],
        "doubts": [name],
        "stopped": name,
        "version": name,
        "seed": name,
        "config": {name: {name: [name]}, "mesh": name},
    }
    state = replace(run, surface=surface, hexes=hexes, path=name)
    return write_report(folder, state, report, drawing=False).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ODD)
def test_the_page_of_a_run(name: str, run: RunState, tmp_path: Path) -> None:
    plain = page_of_a_run(run, PLAIN, tmp_path / "plain")
    odd = page_of_a_run(run, name, tmp_path / "odd")
    plain = plain.replace(json.dumps(PLAIN), PLAIN).replace(json.dumps(name), name)
    assert check(*map(without_settings, (plain, odd)), name.replace("/", "|")) >= 20


def without_settings(page: str) -> str:
    return page


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


@pytest.mark.parametrize("name", ODD)
def test_every_piece(name: str) -> None:
    def made(word: str) -> str:
        return "".join(
            [
                show({word: [word, Swatch(word, "#fff"), Link(word, word)]}),
                facts({word: word}),
                table([{word: word}]),
                folded(word, ""),
                figure(b"png", word, wide=True),
                section("x", word, "y"),
            ]
        )

    assert check(made(PLAIN), made(name), name) == 12
    assert show(Link("x", name)).count(quote(name)) == 1
