"""What the README shows works."""

import re
from dataclasses import dataclass

import numpy as np

from polycube import registry
from polycube.testing import check
from tests.conftest import ROOT


def blocks() -> list[str]:
    """Python of the README, in its order."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def test_the_script_of_the_readme_runs(capfd) -> None:
    script, _ = blocks()
    quick = script.replace("part.step", "example:dice").replace("size=4%", "size=14%")
    known: dict = {}
    exec(quick, known)
    assert known["part"].report["valid"] and known["part"].modes.frequency[-1] > 0


def test_the_plugin_of_the_readme_keeps_the_promises_of_its_kind(monkeypatch) -> None:
    registry.names("schedule")
    monkeypatch.setattr(registry, "_classes", dict(registry._classes))
    _, code = blocks()
    [name] = re.findall(r'@register\("schedule", "(\w+)"\)', code)
    known = {"register": registry.register, "dataclass": dataclass, "np": np, "__name__": "readme"}
    exec(code, known)
    check("schedule", registry.build("schedule", {"plugin": name}))
