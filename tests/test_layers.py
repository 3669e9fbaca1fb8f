"""Imports go downwards only (docs/architecture.md), and heavy packages wait until needed."""

import ast
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tests.conftest import ROOT, first_quick

LAYERS = (  # from the ground up; a module may import its own layer and those before it
    {"types", "errors", "units", "names"},
    {"numerics"},
    {"surface"},
    {"examples"},
    {"structure"},
    {"hexmesh"},
    {"fitting", "charts"},
    {"spline"},
    {"assembly"},
    {"analysis"},
    {"io"},
    {"diffusion"},
    {"kinds"},
    {"registry"},
    {"state"},
    {"stages"},
    {"search"},
    {"config"},
    {"testing"},
    {"pipeline"},
    {"report"},
    {"result"},
    {"api"},
    {"cli", "desk", "evaluate", "mcp", "view"},
)
MOST_FILES = 17  # in a folder
HEAVY = {"igl", "open3d", "pyvista", "vtk", "vtkmodules", "matplotlib", "trimesh"}
FILES = sorted(
    path.relative_to(ROOT) for top in ("polycube", "plugins") for path in (ROOT / top).rglob("*.py")
)


def name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


TESTS = sorted(path.relative_to(ROOT) for path in (ROOT / "tests").rglob("*.py"))
TEST_MODULES = {name(path) for path in TESTS if path.stem.startswith("test_")}
POLYCUBE = [path for path in FILES if path.parts[0] == "polycube"]
PLUGINS = [path for path in FILES if path.parts[0] == "plugins"]


def imports(path: Path, everywhere: bool = True) -> Iterator[str]:
    """Absolute names of what a file imports: everywhere, or only when it is itself imported."""
    return (module for module, is_hidden in _imports(path) if everywhere or not is_hidden)


@cache
def _imports(path: Path) -> list[tuple[str, bool]]:
    """The imports of a file, and whether each is in a function or for types only."""
    hidden = (ast.FunctionDef, ast.Lambda)
    stack = [(node, False) for node in ast.parse((ROOT / path).read_text()).body]
    found = []
    while stack:
        node, is_hidden = stack.pop()
        if isinstance(node, ast.Import):
            found += [(alias.name, is_hidden) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parts = path.with_suffix("").parts[: -node.level] if node.level else ()
            base = ".".join([*parts, *([node.module] if node.module else [])])
            found += [(base, is_hidden)]
            found += [(f"{base}.{alias.name}", is_hidden) for alias in node.names]
        elif isinstance(node, ast.stmt):
            is_hidden |= isinstance(node, hidden) or _is_for_types(node)
            inner = (
                child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr)
            )
            stack += [(child, is_hidden) for child in inner]
        elif not isinstance(node, ast.expr):  # handlers and cases
            stack += [(child, is_hidden) for child in ast.iter_child_nodes(node)]
    return found


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def layer(module: str) -> int:
    """Height of `polycube.X...`; -1 for the package itself."""
    parts = module.split(".")
    if len(parts) == 1 or parts[1] in ("HOME", "__version__"):
        return -1
    [height] = [i for i, names in enumerate(LAYERS) if parts[1] in names]
    return height


def inside(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(package + ".") for package in packages)


def test_no_module_imports_itself_through_others():
    """Imports inside functions count too; the importing of a package by its modules does not."""
    modules = {name(path) for path in FILES}
    graph = {name(path): modules.intersection(imports(path)) - {name(path)} for path in FILES}
    for module, found in graph.items():
        parents = {".".join(module.split(".")[:k]) for k in range(1, module.count(".") + 1)}
        found -= parents
    list(TopologicalSorter(graph).static_order())  # a CycleError names the modules


def test_no_folder_is_too_full():
    number = Counter(path.parent for path in FILES)
    assert {folder: n for folder, n in number.items() if n > MOST_FILES} == {}


def test_no_test_module_is_imported():
    found = {path: TEST_MODULES.intersection(imports(path)) for path in TESTS}
    assert {path: names for path, names in found.items() if names} == {}


def test_every_module_has_a_layer():
    for path in POLYCUBE:
        layer(name(path))


def test_polycube_imports_downwards_only():
    def is_wrong(path: Path, module: str) -> bool:
        if inside(module, "plugins", "polycube.plugins"):
            return True
        return inside(module, "polycube") and layer(module) > layer(name(path))

    assert [(path, m) for path in POLYCUBE for m in imports(path) if is_wrong(path, m)] == []


def test_plugins_know_no_app_and_no_other_kind():
    """Those of the search know its moves."""

    def is_wrong(path: Path, module: str) -> bool:
        if inside(module, "polycube.cli", "polycube.pipeline"):
            return True
        if inside(module, "polycube.search") and path.stem not in ("policy", "estimate"):
            return True
        other = module.replace("polycube.plugins", "plugins").split(".")[1:2]
        is_plugin = inside(module, "plugins", "polycube.plugins")
        return is_plugin and other not in ([], [path.with_suffix("").parts[1]])

    assert [(path, m) for path in PLUGINS for m in imports(path) if is_wrong(path, m)] == []


def test_heavy_packages_are_imported_where_needed():
    found = [(path, m.split(".")[0]) for path in FILES for m in imports(path, everywhere=False)]
    assert [(path, top) for path, top in found if top in HEAVY] == []


@pytest.mark.parametrize(
    ("package", "folders"),
    [
        ("torch", {"diffusion", "testing"}),
        ("lightning", {"diffusion", "cli"}),
        ("hydra", {"cli", "api.py", "config.py"}),
        ("omegaconf", {"cli", "api.py", "config.py"}),
    ],
)
def test_some_packages_stay_in_their_places(package, folders):
    others = [path for path in POLYCUBE if path.parts[1] not in folders]
    assert [path for path in others if any(inside(m, package) for m in imports(path))] == []


@pytest.mark.parametrize(
    ("module", "unwanted"),
    first_quick(
        1,
        [
            ("polycube.surface", {"torch", "hydra", *HEAVY}),
            ("polycube.io", {"torch", "hydra", *HEAVY}),
            ("polycube.spline", {"torch", "hydra", *HEAVY}),
        ],
    ),
)
def test_importing_stays_light(module, unwanted):
    code = (
        "import importlib, pkgutil, sys\n"
        f"package = importlib.import_module({module!r})\n"
        "for info in pkgutil.iter_modules(getattr(package, '__path__', [])):\n"
        "    importlib.import_module(package.__name__ + '.' + info.name)\n"
        "print(*{name.split('.')[0] for name in sys.modules})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert not unwanted & set(done.stdout.split())
