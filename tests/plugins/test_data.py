"""Every data plugin: endless, seeded pairs."""

import numpy as np
import pytest

from polycube.diffusion.pairs.templates import contexts
from polycube.errors import InputError
from polycube.registry import build, names


@pytest.fixture(scope="module")
def primitives() -> dict[str, np.ndarray]:
    order = ("cube", "hole_z", "hole_x", "hole_y")
    return {name: build("primitive", {"plugin": name})() for name in order}


@pytest.mark.parametrize("name", sorted({*names("data")} - {"parts"}))
def test_every_stream_is_seeded_and_endless(name: str, primitives: dict) -> None:
    data = build("data", {"plugin": name})
    streams = [data((2, 1, 1), primitives, seed=seed) for seed in (3, 3, 4)]
    a, b, c = (stream(10**12) for stream in streams)
    assert np.array_equal(a.geometry, b.geometry) and np.array_equal(a.polycube, b.polycube)
    assert not np.array_equal(a.geometry, c.geometry)
    assert len(a.geometry) in (512, 1024) and np.abs(a.geometry).max() < 1.2


def test_paired_takes_every_context_in_turn(primitives: dict) -> None:
    stream = build("data", {"plugin": "paired"})((2, 1, 1), primitives, seed=0)
    assert [stream(i).context for i in range(24)] == contexts((2, 1, 1), primitives)


def test_paired_with_the_published_types_only(primitives: dict) -> None:
    """The same shapes of the nine types; another name is refused."""
    stream = build("data", {"plugin": "paired", "types": "published"})((2, 1, 1), primitives, 0)
    assert [c.count(None) for c in stream.contexts] == [1] * 8 + [0]
    assert np.abs(stream(8).geometry - stream(8).polycube).max() > 0.1
    with pytest.raises(InputError, match="types must be all or published; got 'few'"):
        build("data", {"plugin": "paired", "types": "few"})


def test_paper_has_the_nine_types_with_512_points_a_cell(primitives: dict) -> None:
    stream = build("data", {"plugin": "paper"})((2, 1, 1), primitives, seed=0)
    pairs = [stream(i) for i in range(9)]
    assert [len(pair.geometry) for pair in pairs] == [512] * 8 + [1024]
    assert pairs[8].context == ("cube", "cube")
    assert {pair.context for pair in pairs[:8]} == {
        context for context in contexts((2, 1, 1), primitives) if None in context
    }


def test_paper_jitters_the_polycube(primitives: dict) -> None:
    """Without jitter a geometry is its polycube, centred and scaled; with it, near that."""
    streams = [
        build("data", {"plugin": "paper", "jitter": jitter})((2, 1, 1), primitives, seed=0)
        for jitter in (0.0, 0.02)
    ]
    for i in range(9):
        exact, jittered = (stream(i) for stream in streams)
        low, high = exact.polycube.min(axis=0), exact.polycube.max(axis=0)
        centred = 2 * (exact.polycube - (low + high) / 2) / (high - low).max()
        assert exact.geometry == pytest.approx(centred, abs=0.03)
        assert 0 < np.abs(jittered.geometry - exact.geometry).mean() < 0.02


def test_styles_of_any_structure() -> None:
    """As CAD makes them, or deformed; shares that are none are refused."""
    deformed = build("data", {"plugin": "paired", "cad": 0, "organic": 1})(None, {}, 0)
    assert {deformed.part(i).style for i in range(20)} == {"organic"}
    assert len(deformed(0).geometry) == 256
    with pytest.raises(InputError, match=r"together at most 1; got 0\.7, 0\.4"):
        build("data", {"plugin": "paired", "cad": 0.7, "organic": 0.4})
