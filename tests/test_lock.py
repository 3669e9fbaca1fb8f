"""requirements.lock: what pyproject.toml requires, each with its hashes, and nothing else."""

import re
import sys
from importlib.metadata import PackageNotFoundError, distribution

import pytest
from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.conftest import ROOT

if sys.version_info >= (3, 11):
    import tomllib

LOCK = (ROOT / "requirements.lock").read_text()
PINNED = [
    Requirement(row.replace("\\", "").strip())
    for row in LOCK.splitlines()
    if re.match(r"[a-z]", row)
]
EXTRAS = ("dev", "cad", "cluster", "desk", "mcp")
APART = "torch"  # installed in the build that suits the machine


def test_every_package_has_one_version_and_hashes_and_no_address():
    blocks = re.split(r"\n(?=[a-z])", LOCK)[1:]
    assert len(blocks) == len(PINNED) > 100
    assert all("--hash=sha256:" in block for block in blocks)
    assert all(re.fullmatch(r"==[^,*]+", str(each.specifier)) for each in PINNED)
    assert "://" not in LOCK


@pytest.mark.skipif(sys.version_info < (3, 11), reason="the lock is for Python 3.11 and later")
def test_it_holds_what_is_required_and_nothing_else():
    """Followed through the packages that are installed here."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    rows = project["dependencies"] + [
        row for extra in EXTRAS for row in project["optional-dependencies"][extra]
    ]
    todo = [Requirement(row) for row in rows]
    pinned = {canonicalize_name(each.name): each for each in PINNED}
    required = set()
    while todo:
        each = todo.pop()
        name = canonicalize_name(each.name)
        if name != APART:
            [version] = [row.version for row in pinned[name].specifier]
            assert each.specifier.contains(version, prereleases=True), each
        if (name, *sorted(each.extras)) not in required:
            required.add((name, *sorted(each.extras)))
            todo += followed(name, each.extras)
    here = {name for name, each in pinned.items() if not each.marker or each.marker.evaluate()}
    assert here == {name for name, *_ in required} - {APART}


def followed(name: str, extras: set[str]) -> list[Requirement]:
    """What an installed package requires on this machine; torch without its CUDA packages."""
    try:
        rows = distribution(name).requires or []
    except PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    found = [Requirement(row) for row in rows]
    chosen = [default_environment() | {"extra": extra} for extra in (*extras, "")]
    return [
        each
        for each in found
        if not (name == APART and re.match("nvidia|cuda|triton", each.name))
        if not each.marker or any(each.marker.evaluate(where) for where in chosen)
    ]
