"""The page of the contracts of plugins, from polycube/kinds.py."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path

from docs.generators.reference.markdown import MADE, docstring, sentence, signature, table
from polycube.kinds import KINDS, Kind
from polycube.registry import classes

EXAMPLES = Path(__file__).parent / "examples"  # a module for each protocol, or several

HEAD = """# Kinds of plugin

A plugin is a frozen dataclass that is registered under a kind and a name. Its fields are its
options ([options.md](options.md)), and its method `__call__` does the work. The kind is also the
group on the command line (`spline=optimal`) and the folder in `plugins/`. This page lists what a
plugin of each kind takes and returns. A stage takes fields of the run state and gives one of them;
before a run, `check_chain` tests that every stage finds its inputs. A class may name what to cite
for it in `references: ClassVar[tuple[str, ...]]`: whole BibTeX entries, or keys of
`polycube/report/references.bib`.

Each contract has an example: a complete module. [Training and a
plugin](../tutorials/training_and_plugin.md) puts plugins into a package, so that they are chosen by
name. `polycube.testing.check_plugin` tests that a plugin keeps the contract of its kind; the tests
of this program do that with all examples.

"""


def page() -> str:
    """The text of plugins.md."""
    return "\n\n".join([f"{HEAD}{MADE}", _overview(), *_contracts()]) + "\n"


def _overview() -> str:
    rows = [
        (f"`{name}`", sentence(kind.protocol.__doc__ or ""), ", ".join(_ours(name)))
        for name, kind in KINDS.items()
    ]
    return table(("kind", "what it does", "plugins"), rows)


def _ours(kind: str) -> list[str]:
    """Plugins of this program, without those of installed packages."""
    plugins = {name: cls for (of, name), cls in classes().items() if of == kind}
    return sorted(name for name, cls in plugins.items() if cls.__module__.startswith("polycube."))


def _contracts() -> Iterator[str]:
    """A section for each protocol; several kinds may share one."""
    shared: dict[type, list[str]] = {}
    for name, kind in KINDS.items():
        shared.setdefault(kind.protocol, []).append(name)
    for protocol, kinds in shared.items():
        yield f"## {', '.join(kinds)}"
        yield docstring(protocol)
        yield _stage(KINDS[kinds[0]])
        yield signature(protocol.__call__, "plugin")
        yield docstring(protocol.__call__)
        yield from _members(protocol)
        yield from _examples(kinds)


def _examples(kinds: list[str]) -> Iterator[str]:
    """The example modules of kinds with one protocol."""
    for path in (path for kind in kinds for path in examples(kind)):
        yield f"```python\n{path.read_text(encoding='utf-8')}```"


def examples(kind: str) -> list[Path]:
    """The example modules of a kind."""
    name = kind.replace("/", "_")
    return sorted(EXAMPLES.glob(f"{name}.py")) + sorted(EXAMPLES.glob(f"{name}_*.py"))


def _stage(kind: Kind) -> str:
    if not kind.gives:
        return "Not a stage."
    return f"A stage: takes {', '.join(f'`{each}`' for each in kind.takes)}; gives `{kind.gives}`."


def _members(protocol: type) -> Iterator[str]:
    """Members that the program uses besides the call."""
    annotated = inspect.get_annotations(protocol)
    rows = [(f"`{name}`", str(kind), _comment(protocol, name)) for name, kind in annotated.items()]
    for name, value in vars(protocol).items():
        if not name.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
            rows.append((f"`{name}`", "", sentence(inspect.getdoc(value) or "")))
    if rows:
        yield table(("member", "type", "meaning"), rows)


def _comment(protocol: type, name: str) -> str:
    """The comment on the line of a class that declares a member."""
    lines = inspect.getsource(protocol).splitlines()
    found = next((line for line in lines if line.strip().startswith(f"{name}:")), "")
    return found.partition("# ")[2]
