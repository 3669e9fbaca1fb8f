"""What the README shows works."""

import re
from dataclasses import dataclass

import numpy as np

from polycube import registry
from polycube.testing import check
from tests.conftest import ROOT


def test_the_plugin_of_the_readme_keeps_the_promises_of_its_kind(monkeypatch) -> None:
    registry.names("schedule")
    monkeypatch.setattr(registry, "_classes", dict(registry._classes))
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    [code] = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    [name] = re.findall(r'@register\("schedule", "(\w+)"\)', code)
    known = {"register": registry.register, "dataclass": dataclass, "np": np, "__name__": "readme"}
    exec(code, known)
    check("schedule", registry.build("schedule", {"plugin": name}))
