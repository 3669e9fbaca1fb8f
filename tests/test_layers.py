"""Imports go downwards only (docs/architecture.md), and heavy packages wait until needed."""

import ast
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from tests.conftest import ROOT

LAYERS = (  # from the ground up; a module may import its own layer and those before it
    {"types", "errors", "units"},
    {"numerics"},
    {"surface"},
    {"examples"},
    {"structure"},
    {"hexmesh"},
    {"fitting", "charts", "assembly"},
    {"spline"},
    {"analysis"},
    {"io"},
    {"diffusion"},
    {"kinds"},
    {"registry"},
    {"config"},
    {"testing"},
    {"pipeline"},
    {"report"},
    {"result"},
    {"api"},
    {"cli", "evaluate", "make_pairs"},
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
    tree = ast.parse((ROOT / path).read_text())
    hidden = (ast.FunctionDef, ast.Lambda)
    stack = list(tree.body)
    while stack:
        node = stack.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = path.with_suffix("").parts[: -node.level] if node.level else ()
            base = ".".join([*parts, *([node.module] if node.module else [])])
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names)
        if everywhere or not (isinstance(node, hidden) or _is_for_types(node)):
            stack += ast.iter_child_nodes(node)


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


@pytest.mark.parametrize("path", TESTS, ids=str)
def test_no_test_module_is_imported(path):
    assert not TEST_MODULES.intersection(imports(path))


def test_every_module_has_a_layer():
    for path in POLYCUBE:
        layer(name(path))


@pytest.mark.parametrize("path", POLYCUBE, ids=str)
def test_polycube_imports_downwards_only(path):
    for module in imports(path):
        assert not inside(module, "plugins", "polycube.plugins"), module
        if inside(module, "polycube"):
            assert layer(module) <= layer(name(path)), module


@pytest.mark.parametrize("path", PLUGINS, ids=str)
def test_plugins_know_no_app_and_no_other_kind(path):
    kind = path.with_suffix("").parts[1]
    for module in imports(path):
        assert not inside(module, "polycube.cli", "polycube.pipeline.stages"), module
        if inside(module, "plugins", "polycube.plugins"):
            other = module.replace("polycube.plugins", "plugins").split(".")[1:2]
            assert other in ([], [kind]), module


@pytest.mark.parametrize("path", FILES, ids=str)
def test_heavy_packages_are_imported_where_needed(path):
    for module in imports(path, everywhere=False):
        assert module.split(".")[0] not in HEAVY, module


@pytest.mark.parametrize("path", POLYCUBE, ids=str)
def test_torch_and_hydra_stay_in_their_places(path):
    tops = {module.split(".")[0] for module in imports(path)}
    if path.parts[1] not in ("diffusion", "testing"):
        assert "torch" not in tops
    if path.parts[1] not in ("diffusion", "cli"):
        assert "lightning" not in tops
    if path.parts[1] not in ("cli", "api.py", "config.py"):
        assert not tops & {"hydra", "omegaconf"}


@pytest.mark.parametrize(
    ("module", "unwanted"),
    [
        ("polycube.surface", {"torch", "hydra", *HEAVY}),
        ("polycube.io", {"torch", "hydra", *HEAVY}),
        ("polycube.spline", {"torch", "hydra", *HEAVY}),
    ],
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
