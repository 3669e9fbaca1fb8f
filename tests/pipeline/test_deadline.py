"""Meshing that ends early keeps the best valid mesh."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from polycube.numerics.lbfgs import descend
from polycube.pipeline.deadline import Deadline, TimeIsUp
from polycube.state import RunState
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.stages import TETRAHEDRON

START = RunState(TETRAHEDRON)


@pytest.fixture
def mesh():
    return hex_box()


@pytest.fixture
def inverted(mesh):
    return replace(mesh, hexes=mesh.hexes[:, [4, 5, 6, 7, 0, 1, 2, 3]])


def endless() -> None:
    """Descents that go on for a long time."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        descend(lambda x: (float(x @ x), 2 * x), np.ones(3), 5)


def test_only_valid_meshes_are_stored(mesh, inverted) -> None:
    deadline = Deadline()
    deadline.note(START)
    deadline.note(replace(START, hexes=inverted))
    assert deadline.best(lambda state: 0) is None
    one, other = (replace(START, hexes=mesh, chosen=number) for number in (0, 1))
    deadline.note(one)
    deadline.note(other)
    assert deadline.best(lambda state: state.chosen) is other
    assert deadline.best(lambda state: -state.chosen) is one


def test_hexes_that_are_not_fitted_yet_do_not_crowd_out_others(mesh) -> None:
    bent = replace(mesh, vertices=mesh.vertices + 0.2 * mesh.vertices[:, [1, 2, 0]] ** 2)
    deadline = Deadline()
    for number in range(9):
        deadline.note(replace(START, hexes=mesh, chosen=number), is_fitted=False)
    deadline.note(replace(START, hexes=bent, chosen=9))
    assert deadline.best(lambda state: state.chosen).hexes is bent


def test_time_is_up_in_the_middle_of_a_descent_on_any_thread(mesh) -> None:
    ended = []

    def work() -> None:
        deadline = Deadline(seconds=0.1)
        deadline.note(replace(START, hexes=mesh))
        begin = time.monotonic()
        with pytest.raises(TimeIsUp), deadline.running():
            endless()
        ended.append(0.1 <= time.monotonic() - begin < 10)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    work()
    assert ended == [True, True]


def test_without_a_valid_mesh_it_goes_on_to_the_first(mesh) -> None:
    deadline = Deadline(seconds=1e-3)
    with deadline.running():
        time.sleep(0.05)
        deadline.check()
        deadline.note(replace(START, hexes=mesh))
        with pytest.raises(TimeIsUp):
            deadline.check()
    deadline.check()  # and no more when meshing is over


def test_another_thread_may_interrupt() -> None:
    deadline = Deadline()
    threading.Timer(0.1, deadline.interrupt.set).start()
    with pytest.raises(KeyboardInterrupt), deadline.running():
        endless()
