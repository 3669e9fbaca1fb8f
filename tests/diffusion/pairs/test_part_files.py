"""Files of parts: a written part is read back; a damaged file is refused in one sentence."""

from pathlib import Path

import numpy as np
import pytest

from polycube.diffusion.pairs.part_files import read_part, read_parts, write_part
from polycube.errors import InputError
from tests.fixtures.meshed import part_of


@pytest.fixture(scope="module")
def arrays(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """What the file of an L holds."""
    path = tmp_path_factory.mktemp("parts") / "L.npz"
    write_part(path, part_of("L"))
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


@pytest.mark.parametrize("name", ["box", "frame"])
def test_a_part_is_read_as_it_was_written(name: str, tmp_path: Path) -> None:
    part = part_of(name)
    for file in ("a.npz", "b.npz"):
        write_part(tmp_path / file, part)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    found = read_part(tmp_path / "a.npz")
    assert np.array_equal(found.geometry, part.geometry)
    for a, b in zip(found.surface, part.surface, strict=True):
        assert np.array_equal(a, b)
    for a, b in zip(found.polycube.knots, part.polycube.knots, strict=True):
        assert np.array_equal(a, b)
    assert np.array_equal(found.polycube.occupancy, part.polycube.occupancy)
    assert (found.genus, found.style) == (part.genus, part.style)
    assert len(read_parts(tmp_path)) == 2


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("geometry", lambda x: x[:, :2], r"geometry must have shape \(V, 3\)"),
        ("places", lambda x: x[1:], r"places must have shape \(V, 3\)"),
        ("geometry", lambda x: x * np.nan, "geometry has values that are not finite"),
        ("quads", lambda x: x.astype(float), r"quads must have shape \(Q, 4\)"),
        ("quads", lambda x: x + 1, r"quads must be from 0 to \d+"),
        ("axis", lambda x: x + 1, "axis must be from 0 to 5"),
        ("knot", lambda x: x + 3, "knot must be from 0 to 2"),
        ("knot", lambda x: 0 * x, "places are not on the planes of their labels"),
        ("occupancy", lambda x: ~x, "faces are not arranged as those of the polycube"),
        ("occupancy", lambda x: x[:1], r"x must have shape \(X\+1\)"),
        ("x", lambda x: x[::-1], r"Polycube\.x must ascend"),
        ("places", lambda x: x * 1.01, "places are not on the planes of their labels"),
    ],
)
def test_a_broken_file_is_one_sentence(
    arrays: dict[str, np.ndarray], name: str, change, message: str, tmp_path: Path
) -> None:
    np.savez(tmp_path / "L.npz", **{**arrays, name: change(arrays[name])})
    with pytest.raises(InputError, match=message) as error:
        read_parts(tmp_path)
    assert str(tmp_path / "L.npz") in str(error.value) and "make_pairs" in str(error.value)


def test_a_file_of_something_else_is_refused(arrays: dict[str, np.ndarray], tmp_path: Path) -> None:
    """Text, half a file, one array, objects that would have to be unpickled, another archive."""
    path = tmp_path / "L.npz"
    np.savez(path, **arrays)
    whole = path.read_bytes()
    np.save(tmp_path / "one.npy", arrays["geometry"])
    np.savez(tmp_path / "other.npz", geometry=arrays["geometry"])
    np.savez(tmp_path / "objects.npz", **{**arrays, "axis": np.array([{}, None])})
    made = {
        name: (tmp_path / name).read_bytes() for name in ("one.npy", "other.npz", "objects.npz")
    }
    for content in (b"", b"solid part", whole[: len(whole) // 2], *made.values()):
        path.write_bytes(content)
        with pytest.raises(InputError, match="this is not a file of a part"):
            read_part(path)


def test_a_folder_without_parts_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(InputError, match="there is no part"):
            read_parts(folder)
