"""The time of reading grows at most in proportion to the size of a file, whatever it holds."""

import os
import warnings
from itertools import pairwise
from pathlib import Path

import pytest

from polycube.errors import InputError
from polycube.io.hex_meshes import read_hexes
from polycube.io.surfaces import read_surface
from tests.fixtures.pathological import HEXES, SURFACES

SIZES = (10_000, 100_000, 1_000_000)  # bytes
GROWTH = 12  # largest ratio of times, for a ratio of ten in size
START = 2.0  # seconds of the processor that do not depend on the size: other processes
READERS = {name: (write, read_surface) for name, write in SURFACES.items()}
READERS |= {name: (write, read_hexes) for name, write in HEXES.items()}


def seconds(read, path: Path) -> float:
    """Time of the processor, in this process and in those that it started; the smaller of two.

    One reading may hold a collection of the garbage of earlier tests, or the time of a process
    that one of them started and that ended just now.
    """
    return min(_seconds(read, path), _seconds(read, path))


def _seconds(read, path: Path) -> float:
    before = os.times()
    try:
        read(path)
    except InputError as error:
        assert len(str(error)) < 400
    after = os.times()
    return sum(after[:4]) - sum(before[:4])


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_time_grows_at_most_with_the_size(name: str, tmp_path: Path) -> None:
    write, read = READERS[name]
    path = tmp_path / name
    times = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for size in (1000, *SIZES):  # the first one compiles
            path.write_bytes(write(size))
            times.append(seconds(read, path))
    for short, long in pairwise(times[1:]):
        assert long < GROWTH * short + START, times
