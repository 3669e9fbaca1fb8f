"""Kernels on several threads: the same numbers however many there are."""

import weakref
from functools import partial
from threading import Event, get_ident

import numpy as np
import pytest

from polycube.fitting import energy
from polycube.fitting.energy import Terms
from polycube.numerics import threads
from polycube.surface import closest
from tests.fixtures.fitting import springs
from tests.fixtures.hexmeshes import unit_cubes


def test_parts_cover_everything_once_and_evenly():
    for number, least in [(0, 5), (4, 5), (9, 5), (10, 5), (1000, 5), (7, 1)]:
        cuts = threads.parts(number, least)
        assert np.concatenate([np.arange(number)[c] for c in cuts]).tolist() == list(range(number))
        sizes = [c.stop - c.start for c in cuts]
        assert max(sizes) - min(sizes) <= 1 and len(cuts) <= threads.MOST
        assert len(cuts) == 1 or min(sizes) >= least


def test_results_are_in_order_and_errors_are_raised():
    for number in (0, 1, 9):
        assert threads.side_by_side([lambda k=k: k for k in range(number)]) == list(range(number))
    with pytest.raises(ZeroDivisionError):
        threads.side_by_side([lambda: 1, lambda: 1 / 0])


def test_an_idle_thread_takes_the_next_task(on_cores):
    on_cores(2)
    begun, done = Event(), Event()

    def long():
        begun.set()
        return done.wait(10) and get_ident()

    def last_of_the_others():
        done.set()
        return get_ident()

    calls = [lambda: begun.wait(10) and get_ident(), long, last_of_the_others, get_ident]
    first, other, *rest = threads.side_by_side(calls)
    assert rest == [first, first] and other not in (0, first)


def test_calls_in_the_queue_of_a_busy_thread_keep_no_data(on_cores):
    on_cores(2)
    busy, done = Event(), Event()

    def inner():
        assert busy.wait(10)
        arrays = [np.ones(3) for _ in range(5)]
        total = sum(threads.side_by_side([partial(np.sum, array) for array in arrays]))
        gone = [weakref.ref(array) for array in arrays]
        del arrays
        done.set()
        return total, [each() is None for each in gone]

    def other():
        busy.set()
        return done.wait(10)

    assert threads.side_by_side([inner, other]) == [(15, [True] * 5), True]


@pytest.mark.parametrize("cores", [1, 2, 8])
def test_results_do_not_depend_on_the_number_of_cores(cores, on_cores):
    rng = np.random.default_rng(0)
    x, hexes = unit_cubes(20, 20, 20)
    x = x + 0.1 * rng.normal(size=x.shape)
    lengths = rng.uniform(0.5, 2, (len(hexes), 3))
    tree = closest.tree(rng.normal(size=(200, 3, 3)), rng.normal(size=(200, 3)))
    points, facing = rng.normal(size=(2, 5000, 3))

    def numbers():
        value, gradient = energy.energy(x, hexes, lengths, Terms(jacobian=1.0), springs(len(x)))
        return [value, gradient, *closest.closest(tree, points, facing, 0.1)]

    on_cores(cores)
    found = numbers()
    on_cores(1)
    assert threads.pool() is None
    assert all(np.array_equal(a, b) for a, b in zip(found, numbers(), strict=True))


def test_divided_work_equals_undivided_work():
    rng = np.random.default_rng(0)
    x, hexes = unit_cubes(20, 20, 20)
    x = x + 0.1 * rng.normal(size=x.shape)

    def of(some):
        lengths = np.ones((len(some), 3))
        return energy.energy(x, some, lengths, Terms(jacobian=1.0), springs(len(x)))

    value, gradient = of(hexes)
    halves = np.array_split(hexes, 2)
    assert [len(threads.parts(len(h), energy.LEAST)) for h in (hexes, *halves)] == [2, 1, 1]
    one, other, none = map(of, (*halves, hexes[:0]))  # each has the energy of all springs
    assert value == pytest.approx(one[0] + other[0] - none[0], rel=1e-12)
    expected = one[1] + other[1] - none[1]
    assert gradient == pytest.approx(expected, rel=1e-9, abs=1e-9 * abs(expected).max())
