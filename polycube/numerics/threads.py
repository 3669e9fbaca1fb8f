"""Compiled kernels that release the interpreter lock, on several threads.

The result never depends on the number of threads: work is divided by its size only, and results are
returned in its order.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import TypeVar

MOST = 4  # largest number of threads

Result = TypeVar("Result")


def side_by_side(calls: Sequence[Callable[[], Result]]) -> list[Result]:
    """Results of the calls, in order.

    The first call runs on this thread, which then takes the last calls that no other thread has
    started. A call may use this function itself: a thread waits only for calls that have started,
    and the innermost ones wait for none.
    """
    workers = pool()
    if workers is None or len(calls) < 2:
        return [call() for call in calls]
    waiting = [[call] for call in calls]  # a cancelled one stays in the queue, without its data
    others = [workers.submit(lambda one: one[0](), one) for one in waiting[1:]]
    found = {0: calls[0]()}
    for number in reversed(range(1, len(calls))):
        if others[number - 1].cancel():
            waiting[number].clear()
            found[number] = calls[number]()
    return [found[k] if k in found else others[k - 1].result() for k in range(len(calls))]


def parts(number: int, least: int) -> list[slice]:
    """Up to `MOST` equal slices of a number of items, each of at least `least` items."""
    count = max(1, min(MOST, number // least))
    return [slice(a, b) for a, b in pairwise([number * k // count for k in range(count + 1)])]


def cores() -> int:
    """Number of useful cores: up to `MOST` of those available to the process."""
    number = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return min(number or 1, MOST)


@lru_cache(maxsize=1)
def pool() -> ThreadPoolExecutor | None:
    """Additional threads; None if only one core is available."""
    return ThreadPoolExecutor(cores() - 1) if cores() > 1 else None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=pool.cache_clear)  # threads do not survive a fork
