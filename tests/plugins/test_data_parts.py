"""data=parts: parts that were meshed, turned, among random lattices."""

from pathlib import Path

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import LatticePairs
from polycube.diffusion.pairs.part_files import write_part
from polycube.errors import InputError
from polycube.registry import build
from polycube.testing import check_plugin
from tests.fixtures.meshed import part_of

NAMES = ("L", "box", "frame")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pairs")
    for name in NAMES:
        write_part(path / f"{name}.npz", part_of(name))
    return path


def stream(folder: Path, seed: int = 0, **options: float):
    return build("data", {"plugin": "parts", "path": str(folder), **options})(None, {}, seed)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_requirements_of_its_kind(folder: Path, share: float) -> None:
    check_plugin("data", {"plugin": "parts", "path": str(folder), "share": share})


def test_a_pair_depends_on_seed_and_number_only(folder: Path) -> None:
    first, same, other = (stream(folder, seed)(7) for seed in (0, 0, 1))
    assert np.array_equal(first.geometry, same.geometry)
    assert np.array_equal(first.labels, same.labels)
    assert not np.array_equal(first.geometry, other.geometry)


def test_points_lie_on_the_part_and_on_its_polycube(folder: Path) -> None:
    """These parts are their polycubes: what differs is the roughness of the points."""
    pairs = stream(folder, share=1.0)
    for number in range(20):
        pair = pairs(number)
        assert len(pair.geometry) == 256
        off = (pair.geometry - pair.polycube).std()
        assert off <= pairs.options.deformation.roughness * 1.1
        axis, knot = pair.labels.T
        for a, knots in enumerate(pair.solid.knots):
            own = axis // 2 == a
            assert np.abs(pair.polycube[own, a] - knots[knot[own]]).max() < 1e-12


def test_every_part_comes_in_every_orientation(folder: Path) -> None:
    """The empty box of the L differs in its rotations: four corners of each of three planes."""
    pairs = stream(folder, share=1.0)
    parts = [pairs.part(number) for number in range(600)]
    assert {part.genus for part in parts} == {0, 1}
    shapes = [part.polycube.occupancy for part in parts]
    share = [np.mean([full.size == size for full in shapes]) for size in (1, 4, 9)]
    assert share == pytest.approx([1 / 3] * 3, abs=0.06)
    corners = {(full.shape, *np.argwhere(~full)[0]) for full in shapes if full.size == 4}
    assert len(corners) == 12


@pytest.mark.slow
def test_the_other_parts_are_those_of_a_training_without_these_files(folder: Path) -> None:
    pairs, lattices = stream(folder, share=0.3), LatticePairs(0, 256)
    parts = [pairs.part(number) for number in range(400)]
    meshed = [part.style == "meshed" for part in parts]
    assert np.mean(meshed) == pytest.approx(0.3, abs=0.05)
    for number in np.flatnonzero(~np.array(meshed))[:20].tolist():
        assert np.array_equal(parts[number].geometry, lattices.part(number).geometry)
        assert np.array_equal(pairs(number).geometry, lattices(number).geometry)


def test_views_are_of_one_part(folder: Path) -> None:
    pairs = stream(folder, share=1.0)
    pairs.views = 4
    for number in range(5):
        n_full = {pairs(4 * number + view).solid.occupancy.sum() for view in range(4)}
        assert len(n_full) == 1


def test_a_training_is_measured_on_lattices(folder: Path) -> None:
    data = build("data", {"plugin": "parts", "path": str(folder)})
    found, lattices = data.held_out(None, {}, 5), LatticePairs(5, 256)
    assert np.array_equal(found(3).geometry, lattices(3).geometry)


def test_invalid_options_are_refused(folder: Path, tmp_path: Path) -> None:
    for share in (0.0, 1.2):
        with pytest.raises(InputError, match="share must be above 0 and at most 1; got"):
            build("data", {"plugin": "parts", "path": str(folder), "share": share})
    with pytest.raises(ValueError, match="data=parts needs grid=any"):
        build("data", {"plugin": "parts", "path": str(folder)})((2, 1, 1), {}, 0)
    with pytest.raises(InputError, match="there is no part"):
        stream(tmp_path)
