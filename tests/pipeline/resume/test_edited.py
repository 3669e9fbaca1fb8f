"""Edited files of stages: each wrong value is refused with its name, before anything uses it."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from polycube.errors import InputError
from polycube.pipeline.resume.results import StageResults, load_stage, save, save_stage, stage_name
from polycube.types import Deformation, HexMesh, Labels, Modes, Potential
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.splines import mapped, meshed_box

MESH = hex_box((2, 1, 1))
SPLINE = mapped(meshed_box((2, 1, 1))[0], lambda points: points)
SURFACE = surface_of(MESH)
STAGE = "meshing/smooth"


def edited(value: object, name: str, at: object, number: float) -> object:
    array = np.array(getattr(value, name))
    array[at] = number
    return replace(value, **{name: array})


def extraction(**changed: np.ndarray) -> csr_matrix:
    matrix = SPLINE.extraction.copy()
    for name, array in changed.items():
        setattr(matrix, name, array)
    return matrix


BEYOND = np.where(np.arange(SPLINE.extraction.nnz) == 3, 10**6, SPLINE.extraction.indices)
HOLES = np.where(np.arange(SPLINE.extraction.nnz) == 3, np.nan, SPLINE.extraction.data)


@pytest.mark.parametrize(
    ("kind", "value", "sentence"),
    [
        (STAGE, edited(MESH, "hexes", (0, 0), 10**6), r"HexMesh\.hexes must have numbers from 0"),
        (STAGE, edited(MESH, "hexes", (0, 0), -1), r"HexMesh\.hexes must have numbers from 0"),
        (STAGE, edited(MESH, "quads", (0, 0), 99), r"HexMesh\.quads must have numbers from 0"),
        (STAGE, edited(MESH, "vertices", (0, 0), np.nan), r"HexMesh\.vertices has values that"),
        (STAGE, replace(MESH, sets={"a": np.array([99])}), r"HexMesh\.sets\['a'\] must have"),
        (STAGE, replace(MESH, paths={"1": np.array([99])}), r"HexMesh\.paths\['1'\] must have"),
        (STAGE, replace(MESH, sets={"a": [1]}), r"HexMesh\.sets\['a'\] must be an array"),
        (STAGE, replace(MESH, node_sets={"e": np.array([99])}), r"HexMesh\.node_sets\['e'\] must"),
        (STAGE, replace(MESH, cad_names=["a"]), r"HexMesh\.cad_names must be of the type Mapping"),
        (STAGE, replace(MESH, unit=3), r"HexMesh\.unit must be of the type str"),
        (STAGE, replace(MESH, cad_face=0 * MESH.patch - 1), r"HexMesh\.cad_face must have numbers"),
        ("read", [replace(SURFACE, region_groups={"a": (-1,)}), "a", []], "region_groups"),
        ("read", [replace(SURFACE, region_edges={"a": (1, 2)}), "a", []], "rows of 2 numbers"),
        (STAGE, SPLINE, "no result of stage 'meshing/smooth'"),
        ("spline", edited(SPLINE, "nodes", (0, 0), 10**6), r"Spline\.nodes must have numbers"),
        ("spline", edited(SPLINE, "sides", (0, 1), 6), r"Spline\.sides must have numbers"),
        ("spline", edited(SPLINE, "sides", (0, 0), 2), r"Spline\.sides must have numbers"),
        ("spline", edited(SPLINE, "control", (0, 0), np.inf), r"Spline\.control has values that"),
        ("spline", replace(SPLINE, extraction=extraction(indices=BEYOND)), "is damaged"),
        ("spline", replace(SPLINE, extraction=extraction(data=HOLES)), r"Spline\.extraction has"),
        ("spline", replace(SPLINE, extraordinary_edges="1"), "must be of the type int; got '1'"),
        ("structure", [[], 0], "no result of stage 'structure'"),
        ("read", [MESH, "a", []], "no result of stage 'read'"),
        ("read", [edited(SURFACE, "faces", (0, 0), 999), "a", []], r"TriMesh\.faces must have"),
        ("analysis", [1, 2], "no result of stage 'analysis'"),
    ],
)
def test_a_wrong_value_is_refused_by_name(kind, value, sentence, tmp_path: Path) -> None:
    save_stage(tmp_path, kind, value)
    with pytest.raises(InputError, match=sentence) as refused:
        load_stage(tmp_path, kind)
    assert str(refused.value).startswith(str(tmp_path / stage_name(kind)))
    assert str(refused.value).endswith("resume from an earlier stage")


@pytest.mark.parametrize(
    ("first", "second", "sentence"),
    [
        (SURFACE, Labels(np.zeros(3), np.zeros(3)), "has 3 triangles, not 20"),
        (SPLINE, Modes(np.zeros(1), np.zeros((1, 5, 3)), 1.0), "has 5 functions, not"),
        (SPLINE, Potential(np.zeros(5), np.zeros((1, 3)), (), np.zeros(0), 0.0), "has 5 functions"),
        (
            SPLINE,
            Deformation(
                np.zeros((7, 3)),
                np.zeros((7, 6)),
                np.zeros(7),
                (),
                np.zeros((0, 3)),
                np.zeros(3),
                0.0,
                0.0,
            ),
            "has 7 Bezier nodes",
        ),
    ],
)
def test_results_that_do_not_fit_each_other_are_refused(first, second, sentence, tmp_path) -> None:
    kinds = {Labels: "labels"}
    save_stage(tmp_path, "one", first)
    save_stage(tmp_path, kinds.get(type(second), "two"), second)
    results = StageResults(source=tmp_path)
    results.load("one")
    with pytest.raises(InputError, match=sentence):
        results.load(kinds.get(type(second), "two"))


def test_a_file_that_unpacks_to_much_more_is_refused(tmp_path: Path) -> None:
    path = tmp_path / stage_name(STAGE)
    path.parent.mkdir()
    save(path, MESH)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as file:
        file.writestr("more.npy", bytes(100 << 20))
    with pytest.raises(InputError, match="bytes are compressed to"):
        load_stage(tmp_path, STAGE)


@pytest.mark.parametrize(
    "tree",
    [
        {"class": "freeze", "fields": {}},
        {"class": "HexMesh", "fields": {"vertices": 1}},
        {"planes": "value", "type": "O", "shape": [1]},
        {"planes": "value", "type": "<f8", "shape": [10**12]},
        {"class": "Labels", "fields": {"axis": {"array": "value"}, "patch": {"array": "value"}}},
        [{"dict": []}],
    ],
)
def test_a_wrong_tree_is_refused(tree, tmp_path: Path) -> None:
    path = tmp_path / stage_name("analysis")
    path.parent.mkdir()
    np.savez(path, tree=np.array(json.dumps(tree)), value=np.full(8, 7, np.uint8))
    with pytest.raises(InputError, match="is damaged"):
        load_stage(tmp_path, "analysis")


def test_json_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / stage_name("read")
    path.parent.mkdir()
    np.savez(path, tree=np.array(100_000 * '{"tuple":['))
    with pytest.raises(InputError, match="is damaged"):
        load_stage(tmp_path, "read")


def test_sound_results_are_read(tmp_path: Path) -> None:
    for kind, value in {STAGE: MESH, "spline": SPLINE}.items():
        save_stage(tmp_path, kind, value)
        assert type(load_stage(tmp_path, kind)) is type(value)
    assert isinstance(load_stage(tmp_path, STAGE), HexMesh)
