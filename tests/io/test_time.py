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
    """Time of the processor, in this process and in those that it started.

    It may hold a collection of the garbage of earlier tests, or the time of a process that one of
    them started and that ended just now.
    """
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

    def measured(size: int, times: int = 1) -> float:
        path.write_bytes(write(size))
        return min(seconds(read, path) for _ in range(times))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        measured(1000)  # which compiles
        for small, large in pairwise(SIZES):
            if measured(large) < START:  # it passes whatever the time of the small file is
                continue
            short, long = measured(small, times=2), measured(large, times=2)
            assert long < GROWTH * short + START, (large, short, long)
