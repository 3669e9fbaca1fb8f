"""Every data plugin: endless, seeded pairs."""

from pathlib import Path

import numpy as np
import pytest

from polycube.diffusion.pairs.pairs import cell_mesh
from polycube.diffusion.pairs.templates import contexts, rounded
from polycube.errors import InputError
from polycube.registry import build, names
from polycube.surface.measures import euler

RELEASED = Path(__file__).parents[3] / "shared" / "testdata" / "ddpm_released"


@pytest.fixture(scope="module")
def primitives() -> dict[str, np.ndarray]:
    order = ("cube", "hole_z", "hole_x", "hole_y")
    return {name: build("primitive", {"plugin": name})() for name in order}


@pytest.mark.parametrize("name", names("data"))
def test_every_stream_is_seeded_and_endless(name: str, primitives: dict) -> None:
    data = build("data", {"plugin": name})
    streams = [data((2, 1, 1), primitives, seed=seed) for seed in (3, 3, 4)]
    a, b, c = (stream(10**12) for stream in streams)
    assert np.array_equal(a.geometry, b.geometry) and np.array_equal(a.polycube, b.polycube)
    assert (name == "paper") == np.array_equal(a.geometry, c.geometry)
    assert len(a.geometry) in (512, 1024) and np.abs(a.geometry).max() < 1.2


@pytest.mark.slow
def test_paired_takes_every_context_in_turn(primitives: dict) -> None:
    stream = build("data", {"plugin": "paired"})((2, 1, 1), primitives, seed=0)
    assert [stream(i).context for i in range(24)] == contexts((2, 1, 1), primitives)


def test_paired_with_the_published_types_only(primitives: dict) -> None:
    """The same shapes of the nine types; another name is refused."""
    stream = build("data", {"plugin": "paired", "types": "published"})((2, 1, 1), primitives, 0)
    assert [c.count(None) for c in stream.contexts] == [1] * 8 + [0]
    assert np.abs(stream(8).geometry - stream(8).polycube).max() > 0.1
    with pytest.raises(InputError, match="types must be one of all, published; got 'few'"):
        build("data", {"plugin": "paired", "types": "few"})


def test_paper_has_the_nine_types_with_512_points_a_cell(primitives: dict) -> None:
    stream = build("data", {"plugin": "paper"})((2, 1, 1), primitives, seed=0)
    pairs = [stream(i) for i in range(9)]
    assert [len(pair.geometry) for pair in pairs] == [512] * 8 + [1024]
    assert pairs[8].context == ("cube", "cube")
    every = build("data", {"plugin": "paper", "types": "all"})((2, 1, 1), primitives, 0)
    assert len(every.contexts) == 24 and {p.context for p in pairs} < {*every.contexts}


def test_paper_pairs_a_fixed_mesh_with_the_same_mesh_rounded(primitives: dict) -> None:
    """Both fill the box of their cells, no pair is random, and the labels are those of the face."""
    stream = build("data", {"plugin": "paper"})((2, 1, 1), primitives, seed=0)
    again = build("data", {"plugin": "paper"})((2, 1, 1), primitives, seed=1)
    for i in range(9):
        pair = stream(i)
        assert np.array_equal(pair.geometry, again(i + 9).geometry)
        for points in (pair.geometry, pair.polycube):
            cells = [cell for cell, name in enumerate(pair.context) if name]
            assert np.allclose(points.min(axis=0), [min(cells) - 1, -0.5, -0.5])
            assert np.allclose(points.max(axis=0), [max(cells), 0.5, 0.5])
        moved = np.linalg.norm(pair.geometry - pair.polycube, axis=1)
        assert 0.05 < moved.mean() < 0.1 and moved.max() < 0.3
        axis, cell, wall = pair.labels.T
        off = np.abs(np.take_along_axis(pair.polycube, axis[:, None] // 2, axis=1)[:, 0])
        ends = np.where(axis < 2, np.abs(cell - axis % 2), 0.5)  # x of the faces of both cells
        assert np.allclose(off[wall == 0], ends[wall == 0])
    sharp = build("data", {"plugin": "paper", "rounding": 0})((2, 1, 1), primitives, 0)(3)
    assert np.allclose(sharp.geometry, sharp.polycube, atol=1e-12)


def test_paper_is_refused_where_it_has_no_mesh(primitives: dict) -> None:
    blind = {"blind": build("primitive", {"plugin": "blind_px"})()}
    with pytest.raises(ValueError, match="no mesh of 512 vertices"):
        build("data", {"plugin": "paper"})((2, 1, 1), blind, 0)(0)
    with pytest.raises(InputError, match=r"rounding must be a number, 0 or more; got -1"):
        build("data", {"plugin": "paper", "rounding": -1})


@pytest.mark.parametrize("name", ["cube", "torus_h"])
def test_paper_has_the_structure_of_the_released_meshes(name: str, primitives: dict) -> None:
    """As many vertices and triangles, the same genus, and corners about as round."""
    if not (RELEASED / f"512_{name}.txt").is_file():
        pytest.skip("the released primitives are not here")
    target = {"cube": "512_new_cube_target", "torus_h": "512_torus_h_target"}[name]
    theirs = [np.loadtxt(RELEASED / f"{file}.txt") for file in (f"512_{name}", target)]
    faces = np.loadtxt(RELEASED / f"v_id_per_face_polygon_{name[:5].rstrip('_')}.txt", dtype=int)
    own_name = {"cube": "cube", "torus_h": "hole_z"}[name]
    vertices, own_faces, _ = cell_mesh(primitives[own_name])
    own = [2 * x - 1 for x in (vertices, rounded(vertices, own_faces, 3.0))]
    assert len(vertices) == len(theirs[0]) and len(own_faces) == len(faces)
    assert euler(own_faces) == euler(faces)
    moved = [
        np.linalg.norm(sharp - smooth / np.abs(smooth).max(), axis=1).mean()
        for sharp, smooth in (theirs, own)
    ]
    assert moved[1] == pytest.approx(moved[0], abs=0.1)  # of an edge of 2


def test_styles_of_any_structure() -> None:
    """As CAD makes them, or deformed; shares that are none are refused."""
    deformed = build("data", {"plugin": "paired", "cad": 0, "organic": 1})(None, {}, 0)
    assert {deformed.part(i).style for i in range(20)} == {"organic"}
    assert len(deformed(0).geometry) == 256
    with pytest.raises(InputError, match=r"together at most 1; got 0\.7, 0\.4"):
        build("data", {"plugin": "paired", "cad": 0.7, "organic": 0.4})
