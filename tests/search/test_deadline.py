"""The time limit and the interruption of a run."""

import threading
import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from polycube.numerics.lbfgs import descend
from polycube.search.chain import LEAST_RESERVE, RESERVE, Deadline, TimeIsUp


def endless() -> None:
    """Descents that go on for a long time."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        descend(lambda x: (float(x @ x), 2 * x), np.ones(3), 5)


def test_time_is_up_in_the_middle_of_a_descent_on_any_thread() -> None:
    ended = []

    def work() -> None:
        deadline, begin = Deadline(seconds=0.2), time.monotonic()
        with pytest.raises(TimeIsUp), deadline.running():
            endless()
        ended.append(0.1 <= time.monotonic() - begin < 10 and deadline.is_over)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    work()
    assert ended == [True, True]


@pytest.fixture
def now(monkeypatch) -> list[float]:
    """The time in seconds, which tests may change."""
    now = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


@pytest.mark.parametrize(
    ("seconds", "reserve"),
    [(1.0, 0.5), (4.0, 2.0), (10.0, LEAST_RESERVE), (100.0, RESERVE * 100), (600.0, 60.0)],
)
def test_time_is_kept_for_the_files_and_the_report(seconds, reserve, now) -> None:
    deadline = Deadline(seconds)
    now[0] += seconds - reserve - 1e-6
    assert not deadline.is_over
    deadline.check()
    now[0] += 2e-6
    with pytest.raises(TimeIsUp):
        deadline.check()


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seconds=st.floats(1e-3, 1e6))
def test_at_least_half_of_the_time_is_for_the_mesh(now, seconds) -> None:
    now[0] = 0.0
    deadline = Deadline(seconds)
    now[0] = 0.499 * seconds
    assert not deadline.is_over
    now[0] = seconds
    assert deadline.is_over


def test_without_a_limit_it_does_not_end() -> None:
    deadline = Deadline()
    deadline.check()
    assert not deadline.is_over


def test_another_thread_may_interrupt() -> None:
    deadline = Deadline()
    threading.Timer(0.1, deadline.interrupt.set).start()
    with pytest.raises(KeyboardInterrupt), deadline.running():
        endless()
    assert not deadline.is_over


def test_the_user_comes_before_the_clock() -> None:
    deadline = Deadline(seconds=1e-9)
    deadline.interrupt.set()
    with pytest.raises(KeyboardInterrupt):
        deadline.check()


def test_descents_after_the_search_are_not_ended() -> None:
    deadline = Deadline(seconds=1e-9)
    with deadline.running():
        pass
    descend(lambda x: (float(x @ x), 2 * x), np.ones(3), 5)
