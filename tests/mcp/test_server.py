"""The tools, used by the client of the protocol's own library."""

import asyncio
import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mcp")

from anyio import CancelScope, fail_after
from mcp import Client, StdioServerParameters

from polycube.hexmesh.settings import MeshingSettings
from polycube.io.stl import write_stl
from polycube.mcp.server import Server
from polycube.registry import classes, options
from tests.conftest import ROOT
from tests.fixtures.runs import tree
from tests.fixtures.surfaces import box


def call(folder: Path, tool: str, **arguments: Any) -> tuple[bool, str]:
    """Whether a call failed, and its text."""

    async def work() -> tuple[bool, str]:
        async with Client(Server(folder)) as client:
            found = await client.call_tool(tool, arguments)
            return found.is_error, found.content[0].text

    return asyncio.run(work())


def schemas(tool: str) -> dict[str, Any]:
    """The schemas of the options of plugins in the arguments of a tool, by class."""

    async def work() -> dict[str, Any]:
        async with Client(Server(ROOT)) as client:
            [found] = [each for each in (await client.list_tools()).tools if each.name == tool]
            return found.input_schema["$defs"]

    return asyncio.run(work())


def test_the_tools_for_reading_are_marked() -> None:
    async def work() -> dict[str, bool]:
        async with Client(Server(ROOT)) as client:
            tools = (await client.list_tools()).tools
            return {each.name: bool(each.annotations.read_only_hint) for each in tools}

    reading = dict.fromkeys(["files", "options", "check", "results"], True)
    assert asyncio.run(work()) == reading | {"mesh": False, "solve": False}


def test_the_schemas_have_the_options_of_the_plugins_with_their_defaults() -> None:
    found = schemas("solve")
    known = [(name, cls) for (kind, name), cls in classes().items() if kind == "analysis"]
    assert len(known) >= 3
    for name, cls in known:
        fields = found[cls.__name__]["properties"]
        assert fields.pop("plugin")["const"] == name
        assert list(fields) == list(options("analysis", cls))
        for key, option in options("analysis", cls).items():
            assert fields[key]["default"] == json.loads(json.dumps(option.default))
            assert len(fields[key]["description"]) > 5
    fields = schemas("mesh")["MeshingSettings"]["properties"]
    assert list(fields) == list(options("meshing", MeshingSettings))
    assert fields["size"]["default"] == "5%"
    assert fields["size"]["anyOf"] == [{"type": "number"}, {"type": "string"}]


OUTSIDE = [
    ("check", {"part": "/etc/passwd"}),
    ("mesh", {"part": "../other.stl"}),
    ("mesh", {"part": "link.stl"}),
    ("mesh", {"part": "part.stl", "settings": {"ckpt": "../weights.ckpt"}}),
    ("mesh", {"part": "part.stl", "settings": {"structure": {"paths": ["a", "/etc"]}}}),
    ("mesh", {"part": "part.stl", "meshing": {"size": "../5%"}}),
    ("mesh", {"part": "zero\0.stl"}),
    ("results", {"run": ".."}),
    ("solve", {"run": "linked", "analysis": {"plugin": "modal"}}),
    ("solve", {"run": "run", "analysis": {"plugin": "modal", "material": "/steel"}}),
    ("options", {"choice": "spline=../h2s"}),
]


@pytest.mark.parametrize(("tool", "arguments"), OUTSIDE)
def test_a_path_outside_of_the_folder_is_refused(tool, arguments, tmp_path) -> None:
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    for each in (folder / "run", outside):
        each.mkdir(parents=True)
    for each in (folder / "part.stl", outside / "part.stl"):
        each.touch()
    (folder / "run" / "config.json").write_text('{"mesh": "part.stl", "hex": null}')
    (folder / "link.stl").symlink_to(outside / "part.stl")
    (folder / "linked").symlink_to(outside)
    before = tree(tmp_path)
    failed, text = call(folder, tool, **arguments)
    assert failed and text.endswith(": this path is outside of the folder of the server")
    assert tree(tmp_path) == before


def test_results_are_not_written_through_a_link(tmp_path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "outside").mkdir()
    (tmp_path / "folder" / "outputs").symlink_to(tmp_path / "outside")
    failed, text = call(tmp_path / "folder", "mesh", part="example:rod")
    assert failed and text == "outputs: this path is outside of the folder of the server"


NAMES = "output_dir hydra.run.dir hydra/launcher mesh preflight resume +a ~spline spline@x a=b"


@pytest.mark.parametrize("name", NAMES.split())
def test_settings_of_the_tools_and_of_hydra_are_refused(name, tmp_path) -> None:
    failed, text = call(tmp_path, "mesh", part="example:rod", settings={name: "x"})
    assert failed and text == f"{name}: this setting cannot be given; `options` lists the others"


REFUSED = [
    ("mesh", {"part": "none.stl"}, "none.stl: there is no such file in the folder of the server"),
    ("mesh", {"part": "rod"}, "rod: there is no such file in the folder of the server"),
    ("mesh", {"part": "example:rod", "meshing": {"sice": 1}}, "meshing.sice"),
    ("results", {"run": "none"}, "report.json: there is no such file; name the folder of a run"),
    ("solve", {"run": "none", "analysis": {"plugin": "modal"}}, "config.json: there is no such"),
    ("solve", {"run": "none", "analysis": {"plugin": "modale"}}, "'modal', 'poisson', 'static'"),
    ("options", {"choice": "spline=h3s"}, "spline=h3s: there is no such choice; did you mean h2s;"),
]


@pytest.mark.parametrize(("tool", "arguments", "sentence"), REFUSED)
def test_a_wrong_argument_is_named(tool, arguments, sentence, tmp_path) -> None:
    failed, text = call(tmp_path, tool, **arguments)
    assert failed and sentence in text
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_choices_and_their_options_are_explained(tmp_path) -> None:
    _, text = call(tmp_path, "options", choice="analysis=modal")
    assert "analysis.modes=20\n    number of modes" in text
    _, text = call(tmp_path, "options")
    assert "\n  poisson  " in text and "\nseconds: null # time limit" in text
    assert call(tmp_path, "options", choice="grid=auto") == (False, "grid=auto has no options")


def test_numbers_are_short(tmp_path) -> None:
    middle = {"kind": "direction", "centroid": [0.123456789, 2.0, -1e-9]}
    report = {
        "valid": False,
        "failure": "too few hexes",
        "hex": {"hexes": 123456, "sets": {"z_max": middle}},
        "mesh_warnings": ["look at it"],
        "seconds": {"read": 1.04},
    }
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "report.json").write_text(json.dumps(report))
    found = json.loads(call(tmp_path, "results", run="run")[1])
    assert found["sets"]["z_max"]["centroid"] == [0.12346, 2.0, -1e-9]
    assert found["numbers"]["hexes"] == 123456 and found["numbers"]["seconds"] == 1
    assert not found["valid"] and found["failure"] == "too few hexes"
    assert found["warnings"] == ["look at it"] and found["files"] == []


@pytest.mark.slow
def test_a_bar_is_meshed_and_solved(tmp_path) -> None:
    """From another process by stdin and stdout; the solution is exact."""
    bar = box(high=(10.0, 10.0, 40.0))
    write_stl(tmp_path / "a,bar.stl", bar.vertices, bar.faces)
    write_stl(tmp_path / "open.stl", bar.vertices, bar.faces[1:])
    (tmp_path / "numpy.py").write_text("raise SystemExit('a module of the folder was imported')")
    command = ["-m", "polycube.mcp", str(tmp_path)]
    served = StdioServerParameters(
        command=sys.executable, args=command, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    material = {"young": 1e11, "poisson": 0.3, "density": 1000}
    fixed = [{"at": f"{axis}_min", "components": [axis]} for axis in "xyz"]

    def pulled(force: float) -> dict[str, Any]:
        loads = [{"at": "z_max", "force": [0, 0, force]}]
        return {"plugin": "static", "material": material, "fixed": fixed, "loads": loads}

    async def work() -> None:
        said = []

        async def progress(number: float, total: float | None, message: str | None) -> None:
            said.append((number, str(message)))

        async with Client(served) as client:
            refused = await client.call_tool("check", {"part": "open.stl"})
            text = refused.content[0].text
            assert refused.is_error and "edges with one face only" in text.splitlines()[-1]
            sound = await client.call_tool("check", {"part": "a,bar.stl"})
            assert not sound.is_error and "volume 4000 mm^3" in sound.content[0].text
            arguments = {
                "meshing": {"size": 5},
                "settings": {"structure": "slices", "effort": "first"},
            }
            made = await client.call_tool(
                "mesh", {"part": "a,bar.stl", **arguments}, progress_callback=progress
            )
            first = made.structured_content
            assert first["valid"] and first["numbers"]["hexes"] >= 32
            assert first["sets"]["z_max"]["centroid"] == [5, 5, 40]
            assert [number for number, _ in said] == list(range(1, len(said) + 1))
            assert any("meshing/subdivide" in line for _, line in said)
            solved = [first]
            for force, begin in ((100.0, "spline"), (200.0, "analysis")):
                where = {"run": solved[-1]["run"], "begin": begin}
                found = await client.call_tool("solve", {**where, "analysis": pulled(force)})
                solved.append(found.structured_content)
                static = found.structured_content["static"]
                sides = math.hypot(4, 0.3, 0.3) * 1e-6 * force  # 40 and 10 mm of 1 MPa / 100 GPa
                assert static["max_displacement"] == pytest.approx(sides, rel=1e-4)
                assert static["max_von_mises"] == pytest.approx(1e4 * force, rel=1e-4)
                assert "static.vtu" in found.structured_content["files"]
            listed = (await client.call_tool("files")).structured_content
            assert listed["parts"] == ["a,bar.stl", "open.stl"]
            assert {each["name"] for each in listed["runs"]} == {each["run"] for each in solved}
            assert len(listed["runs"]) == 3

    asyncio.run(work())


@pytest.mark.slow
def test_a_cancelled_call_ends_the_run_with_the_best_mesh(tmp_path, import_first) -> None:
    import_first(ROOT)

    async def work() -> None:
        scope = CancelScope()

        async def progress(_: float, __: float | None, message: str | None) -> None:
            if "meshing/pillow" in str(message):
                scope.cancel()

        arguments = {"part": "example:rod", "meshing": {"size": "5%"}}
        async with Client(Server(tmp_path)) as client:
            with scope:
                settings = {"structure": "slices"}
                await client.call_tool(
                    "mesh", {**arguments, "settings": settings}, progress_callback=progress
                )
            assert scope.cancelled_caught
            runs: list[dict[str, Any]] = []
            with fail_after(100):
                while not runs:
                    await asyncio.sleep(0.5)
                    runs = (await client.call_tool("files")).structured_content["runs"]
            [run] = runs
            found = (await client.call_tool("results", {"run": run["name"]})).structured_content
            assert found["interrupted"] and found["numbers"]["hexes"] > 0

    asyncio.run(work())
