"""The page of the Python interface, from its docstrings."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

from docs.generators.reference.markdown import MADE, docstring, sentence, signature, table
from polycube import errors, testing, types
from polycube.api import citation, mesh
from polycube.result import Result

HEAD = """# Python interface

```python
import polycube

part = polycube.mesh("part.step", size="4%", order=["meshing"])
print(part.hexes.hexes.shape, part.report["hex"]["min_scaled_jacobian"], part.warnings)
```

`polycube.mesh` and `polycube.Result` are the interface; the data types below are what a `Result`
holds. Nothing of the process is changed, so the call works in a notebook, in a thread and inside
another Hydra program.

"""
ERRORS = (errors.PolycubeError, errors.InputError, errors.MeshingError)
DATA = sorted(name for name, kind in vars(types).items() if inspect.isclass(kind))


def page() -> str:
    """The text of api.md."""
    blocks = [f"{HEAD}{MADE}"]
    blocks += _function("polycube.mesh", mesh)
    blocks += _class("polycube.Result", Result)
    blocks += _function("polycube.citation", citation)
    blocks.append("## Errors")
    for error in ERRORS:
        blocks += [f"### polycube.errors.{error.__name__}", docstring(error)]
    blocks += ["## Data types", sentence(types.__doc__ or "")]
    for name in DATA:
        cls = getattr(types, name)
        if cls.__module__.startswith("polycube."):
            blocks += _class(f"polycube.types.{name}", cls, "###")
    blocks.append("## For authors of plugins")
    blocks += _function("polycube.testing.check_plugin", testing.check_plugin, "###")
    return "\n\n".join(block for block in blocks if block) + "\n"


def _function(name: str, function: object, level: str = "##") -> Iterator[str]:
    yield f"{level} {name}"
    yield signature(function, name)
    yield docstring(function)


def _class(name: str, cls: type, level: str = "##") -> Iterator[str]:
    """A class with a table of its public methods and properties."""
    yield f"{level} {name}"
    yield docstring(cls)
    members = [
        (f"`{key}`", sentence(inspect.getdoc(value) or ""))
        for key, value in vars(cls).items()
        if not key.startswith("_") and _is_member(value)
    ]
    if members:
        yield table(("member", "meaning"), members)


def _is_member(value: object) -> bool:
    return isinstance(value, property | staticmethod | classmethod) or inspect.isfunction(value)
