"""The table of docs/reference/files.md: what each format holds."""

import re
from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, names, options, provide
from tests.conftest import ROOT
from tests.fixtures.hexmeshes import hex_box

PAGE = (ROOT / "docs" / "reference" / "files.md").read_text(encoding="utf-8")
ROWS = re.findall(
    r"^\| `(\w+)` \| ([^|]*) \| ((?:ASCII|all)[^|]*) \| (\w+) \| (\w+) \| ([\d, ]+) \|", PAGE, re.M
)
BOX = hex_box((3, 2, 2), (3.0, 2.0, 2.0))
LONG = "cad_" + 70 * "面x9"
SETS = {"cad_面": boundary_sets(BOX)["x_min"], LONG: boundary_sets(BOX)["x_max"]}
MESH = replace(BOX, sets=SETS, primitives=("cube",))
YOUNG = {"abaqus": "210000.", "nastran": "2.100000000E+05", "febio": "<E>210000</E>"}
YOUNG["lsdyna"] = ",210000,0.3"


def written(name, folder, **analysis) -> bytes:
    problem = build("analysis", {"plugin": "static", "units": "mm", **analysis}).problem
    path = provide(build("export", {"plugin": name}), problem=problem)(MESH, folder / "hex")
    if name == "jaxiga":
        return "\n".join(np.load(path)).encode()
    return path.read_bytes()


def test_every_format_is_in_the_table() -> None:
    assert sorted(name for name, *_ in ROWS) == names("export")


@pytest.mark.parametrize(("name", "sets", "letters", "material", "loads", "nodes"), ROWS)
def test_a_row(name, sets, letters, material, loads, nodes, tmp_path) -> None:
    plain = written(name, tmp_path, fixed=["cad_面"])
    short = "cad_u9762" if letters.startswith("ASCII") else "cad_面"
    assert short.encode() in plain
    length = int(re.search(r"\d+", letters)[0]) if "," in letters else len(LONG.encode())
    full = LONG.replace("面", "u9762") if letters.startswith("ASCII") else LONG
    cut = full.encode()[:length].decode(errors="ignore").encode()
    assert cut in plain and (
        len(full.encode()) <= length or full.encode()[: length + 3] not in plain
    )
    assert (b"cube" in plain) == ("hexes" in sets or name in ("vtk", "exodus", "medit"))
    assert (YOUNG.get(name, "no Young's modulus").encode() in plain) == (material == "yes")
    pulled = written(name, tmp_path, fixed=["cad_面"], loads=[{"at": LONG, "pressure": 1e6}])
    held = written(name, tmp_path, fixed=[LONG])
    assert (pulled != plain) == (held != plain) == (loads == "yes")
    known = [int(n) for n in nodes.split(", ")]
    wanted = {20: "C3D20R"} if name == "abaqus" else {n: n for n in (20, 27)}
    option = "element" if name == "abaqus" else "nodes"
    for count in (20, 27):
        value = wanted.get(count, f"C3D{count}")
        if option not in options("export", type(build("export", {"plugin": name}))):
            assert count not in known
        elif count in known:
            build("export", {"plugin": name, option: value})
        else:
            with pytest.raises(ValueError, match=f"{option} must be"):
                build("export", {"plugin": name, option: value})
