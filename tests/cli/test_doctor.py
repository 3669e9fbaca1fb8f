"""The doctor names what is missing and does not fall ill itself."""

import sys

import pytest

from polycube.cli import doctor


def test_every_item_is_one_line(capsys, monkeypatch):
    monkeypatch.setattr(doctor, "_probe", lambda name, code: (name, True, "not tested here"))
    doctor.main()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(list(doctor.examine()))
    assert all(line.startswith(("ok ", "MISSING ")) for line in lines)
    assert any("python" in line and sys.version.split()[0] in line for line in lines)


@pytest.mark.parametrize(
    ("item", "more"),
    [
        (doctor._package("no-such-package-here"), "pip install no-such-package-here"),
        (doctor._writable(doctor.Path("no/such/folder")), "no/such/folder: No such file"),
        (doctor._probe("x", "import no_such_module_here"), "No module named"),
        (doctor._probe("x", "import os; os._exit(7)"), "ended with code 7"),
    ],
)
def test_what_is_missing_is_named(item, more):
    _, works, text = item
    assert not works and more in text and "\n" not in text


def test_slow_probe_is_given_up(monkeypatch):
    monkeypatch.setattr(doctor, "TIMEOUT", 0.2)
    assert doctor._probe("x", "import time; time.sleep(9)") == (
        "x",
        False,
        "no answer within 0.2 seconds",
    )


def test_exit_code_tells_whether_all_is_there(monkeypatch):
    for works in (True, False):
        monkeypatch.setattr(doctor, "examine", lambda works=works: iter([("it", works, "")]))
        assert doctor.main() == int(not works)


def test_missing_library_names_its_package(monkeypatch):
    monkeypatch.setattr(doctor, "_probe", lambda name, code: (name, True, ""))
    monkeypatch.setattr(doctor, "find_library", lambda name: None)
    missing = [more for name, works, more in doctor.examine() if not works]
    assert [more.split()[-1] for more in missing] == [
        "libusb-1.0-0",
        "libegl1",
        "libgl1",
        "libx11-6",
    ]


@pytest.mark.parametrize("found", ["/usr/bin/chromium", None])
def test_optional_items_are_listed_and_never_missing(monkeypatch, found):
    monkeypatch.setattr(doctor, "which", lambda name: found)
    monkeypatch.setattr(doctor, "_probe", lambda name, code: (name, "gmsh" not in name, "no gmsh"))
    items = {name: (works, more) for name, works, more in doctor.examine()}
    assert items["browser"][0] and (found or "only tests") in items["browser"][1]
    works, more = items["gmsh (CAD)"]
    assert not works and "pip install 'polycube[cad]'" in more and "cascadio reads STEP" in more
